//! What can be wrong with points and with the files beside them, and what would help.

use super::misread::{Misread, Reading};
use crate::discovery::recording::Error;
use crate::units::{Dimension, significant};

pub(super) fn no_points() -> Error {
    Error::new("there are no points", "command line", "name at least one CSV file")
}

pub(super) fn no_camera(file: &str) -> Error {
    Error::new(
        "nothing says what the camera is",
        file,
        "put it beside the points as a JSON file of the same name, {\"camera\": {\"fx_px\": .., \"fy_px\": .., \
         \"cx_px\": .., \"cy_px\": ..}}, or name a model whose scene has a camera with `--model`",
    )
}

pub(super) fn some_posed(file: &str) -> Error {
    Error::new(
        "some files have extrinsics and some have none",
        file,
        "give every file its `.extrinsics.json`, or one `world_from_camera` for all",
    )
}

/// There are `n` points, and `least` are needed.
pub(super) fn too_few(n: usize, least: usize, file: &str) -> Error {
    Error::new(
        format!("{n} points are too few to tell anything from"),
        file,
        format!("give at least {least}, spread over the picture"),
    )
}

pub(super) fn two_places(point: &str, time: f64, file: &str, line: usize) -> Error {
    Error::new(
        format!("point `{point}` is at two places at {time} s"),
        format!("{file}:{line}"),
        "give each point its own name in the column `point`",
    )
}

/// The pose of a view is not known and cannot be fitted.
fn no_pose(what: String, place: &str) -> Error {
    Error::new(
        what,
        place,
        "give the camera's pose of every view in `.extrinsics.json`, or take flat targets (z = 0) with at \
         least four points each",
    )
}

pub(super) fn pose_needs_more(n: usize, place: &str) -> Error {
    no_pose(format!("the pose of a picture cannot be fitted to {n} points"), place)
}

pub(super) fn pose_not_found(why: &impl ToString, place: &str) -> Error {
    no_pose(format!("the picture's pose is not found: {}", why.to_string()), place)
}

pub(super) fn behind(file: &str, line: usize) -> Error {
    Error::new(
        "the point lies behind the camera",
        format!("{file}:{line}"),
        "is `world_from_camera` the right way round? the camera looks along its z, x is right, y is down",
    )
}

/// The search ran away.
pub(super) fn unfitted(what: String, file: &str) -> Error {
    Error::new(what, file, "are the units and the camera's numbers right?")
}

pub(super) fn not_fitted(why: &impl ToString, file: &str) -> Error {
    unfitted(format!("the points cannot be fitted by any camera: {}", why.to_string()), file)
}

/// The pixels are not what they are taken for.
pub(super) fn misread(Misread { reading, off_px, then_px }: Misread, file: &str) -> Error {
    let mirrored = "u is to the right and v is down, from the top left pixel: write the pixels of the picture as the camera took it, \
                    or the camera's pose as it hung";
    let (what, help) = match reading {
        Reading::Exchanged => (
            "u and v are exchanged".to_owned(),
            "exchange them: `--map 'u=v[px],v=u[px]'`; u is to the right, v is down".to_owned(),
        ),
        Reading::LeftToRight => ("the picture is mirrored, left for right".into(), mirrored.into()),
        Reading::UpsideDown => ("the picture is mirrored, top for bottom".into(), mirrored.into()),
        Reading::HalfATurn => ("the picture is turned by half a turn".into(), mirrored.into()),
        Reading::Times(times) => {
            let size = significant(1.0 / times, 3);
            (
                format!("the pixels are of a picture {size} times as large as the camera's"),
                format!(
                    "give the camera at the size of these pictures, `fx_px`, `fy_px`, `cx_px` and `cy_px` times {size}, or the pixels at the \
                     camera's"
                ),
            )
        }
    };
    let (off, then) = (significant(off_px, 3), significant(then_px, 2));
    Error::new(
        format!(
            "{what}: read so, points are {then} px from where the camera shows them, as they are {off} px (median)"
        ),
        file,
        help,
    )
}

/// An effect that the model has already is not read.
pub(super) fn not_an_effect(bad: &BadParameter, effect: String) -> Error {
    Error::new(
        bad.to_string(),
        effect,
        "see the vocabulary of effects for names, places and parameters",
    )
}

pub(super) fn noise_unknown(n: usize, file: &str) -> Error {
    Error::new(
        format!("{n} points are too few to tell how noisy they are"),
        file,
        "say it in the JSON file beside the points, {\"noise\": {\"px\": 0.3}}, or give more points",
    )
}

pub(super) fn too_few_left(file: &str) -> Error {
    Error::new(
        "too few points are left to fit and to judge",
        file,
        "give more points or more views, or hold out another part with `--holdout`",
    )
}

pub(super) fn column_unit(column: &str, is: Dimension, expected: Dimension, file: &str) -> Error {
    Error::new(
        format!("column `{column}` is in {}, but it must be {}", is.si(), expected.words()),
        format!("{file}:1, column `{column}`"),
        format!("write `{column}[{}]`, or correct it with `--map`", expected.si()),
    )
}

pub(super) fn no_column(column: &str, file: &str) -> Error {
    Error::new(
        format!("there is no column `{column}`"),
        format!("{file}:1"),
        "points are a table `x[m],y[m],z[m],u[px],v[px],view`, and `t[s]` where they move",
    )
}

pub(super) fn extrinsics(why: &impl ToString, place: &str) -> Error {
    Error::new(why.to_string(), place, "leave the file out where no pose is known")
}

pub(super) fn view_without_pose(view: &str, known: &[&str], place: &str) -> Error {
    Error::new(
        format!("view `{view}` has no pose"),
        place,
        format!("the file has {}; give every view one", known.join(", ")),
    )
}

pub(super) fn not_finite(cell: &str, column: &str, file: &str, line: usize) -> Error {
    Error::new(
        format!("`{cell}` is not a finite number"),
        format!("{file}:{line}, column `{column}`"),
        "leave out rows whose point was not seen",
    )
}

pub(super) fn too_many_views(most: usize, file: &str, line: usize) -> Error {
    Error::new(
        format!("it has more than {most} views, each with a pose of its own"),
        format!("{file}:{line}, column `view`"),
        "is `view` the picture, and not the point? give fewer pictures",
    )
}

pub(super) fn no_rows(file: &str) -> Error {
    Error::new(
        "there are no rows",
        file,
        "give a row per point and picture: `x[m],y[m],z[m],u[px],v[px],view`",
    )
}

/// The file of the camera is not one.
fn sidecar(what: String, place: &str) -> Error {
    Error::new(
        what,
        place,
        "write {\"camera\": {\"fx_px\": .., \"fy_px\": .., \"cx_px\": .., \"cy_px\": .., \"k1\": ..}, \
         \"world_from_camera\": {\"xyz_m\": [..], \"quat_wxyz\": [..]}, \"noise\": {\"px\": ..}}; every \
         key may be left out",
    )
}

pub(super) fn no_sidecar(why: &impl ToString, place: &str) -> Error {
    sidecar(format!("not a camera's file: {}", why.to_string()), place)
}

pub(super) fn no_noise(px: f64, place: &str) -> Error {
    sidecar(format!("`noise.px` is {px}; it must be above 0"), place)
}

/// A parameter of an effect in a model file that cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum BadParameter {
    /// The effect has no such parameter.
    #[error("`{effect}` has no `{parameter}`, but {}", .known.join(", "))]
    Unknown {
        /// Name and site of the effect.
        effect: String,
        /// What was given.
        parameter: String,
        /// What the effect has.
        known: Vec<&'static str>,
    },
    /// A parameter that the effect cannot do without is not given.
    #[error("`{effect}` needs `{parameter}`")]
    Missing {
        /// Name and site of the effect.
        effect: String,
        /// What is missing.
        parameter: &'static str,
    },
    /// The parameter measures something else.
    #[error("`{parameter}` of `{effect}` is {}, but it must be {}", .is.words(), .expected.words())]
    Unit {
        /// Name and site of the effect.
        effect: String,
        /// What was given.
        parameter: &'static str,
        /// What it measures.
        is: Dimension,
        /// What it must measure.
        expected: Dimension,
    },
}
