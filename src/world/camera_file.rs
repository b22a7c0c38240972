//! A calibrated camera as a file: what is inside it, and where it stands if that is known.
//!
//! One reader for all commands. What `camera calibrate` writes and `align intrinsics --json` prints is read, and so is
//! a camera written by hand:
//!
//! ```text
//! {"camera": {"intrinsics": {"fx": .., "fy": .., "cx": .., "cy": .., "skew": .., "k1": .., "k2": ..,
//!             "p1": .., "p2": .., "k3": .., "width": .., "height": ..}, "world_from_camera": {..}}}
//! {"camera": {"fx_px": .., "fy_px": .., "cx_px": .., "cy_px": .., "k1": .., ..}, "world_from_camera": {..}}
//! {"fx_px": .., "fy_px": .., "cx_px": .., "cy_px": .., "k1": .., .., "image_px": [width, height]}
//! ```
//!
//! A fisheye has `"model": "fisheye"` and `k1` to `k4` beside each other; without `model` a lens is Brown's.
//! `world_from_camera` may be absent, and so may terms of the lens (0), `fy_px` (square pixels) and the size of the
//! picture (0: not known).

use serde::Deserialize;

use super::{Intrinsics, LensModel, Pose, frame};

/// A camera as a file tells it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CameraFile {
    /// What is inside; width and height are 0 where the file does not say.
    pub intrinsics: Intrinsics,
    /// Where it stands, if the file says.
    pub world_from_camera: Option<Pose<frame::World, frame::Camera>>,
}

/// Why a text is no calibrated camera.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Error {
    /// It is no JSON, or lacks a number.
    #[error("{why}")]
    Json {
        /// What is wrong.
        why: String,
    },
    /// Terms of two lenses in one.
    #[error("{term} is no term of a {} lens", model.name())]
    Term {
        /// Which.
        term: &'static str,
        /// The lens.
        model: LensModel,
    },
    /// A number that no camera has.
    #[error("{what} is {value} px, which no camera has")]
    Number {
        /// Which.
        what: &'static str,
        /// Its value.
        value: f64,
    },
}

#[derive(Deserialize)]
struct Flat {
    fx_px: f64,
    fy_px: Option<f64>,
    cx_px: f64,
    cy_px: f64,
    #[serde(default)]
    skew_px: f64,
    #[serde(default)]
    k1: f64,
    #[serde(default)]
    k2: f64,
    #[serde(default)]
    p1: f64,
    #[serde(default)]
    p2: f64,
    #[serde(default)]
    k3: f64,
    #[serde(default)]
    k4: f64,
    #[serde(default)]
    model: LensModel,
    image_px: Option<[u32; 2]>,
}

impl From<Flat> for Intrinsics {
    fn from(flat: Flat) -> Self {
        let [width, height] = flat.image_px.unwrap_or_default();
        Self {
            fx: flat.fx_px,
            fy: flat.fy_px.unwrap_or(flat.fx_px),
            cx: flat.cx_px,
            cy: flat.cy_px,
            skew: flat.skew_px,
            k1: flat.k1,
            k2: flat.k2,
            p1: flat.p1,
            p2: flat.p2,
            k3: flat.k3,
            k4: flat.k4,
            model: flat.model,
            width,
            height,
        }
    }
}

/// Reads a camera from the text of a file.
///
/// # Errors
///
/// [`Error`], saying what is missing or what no camera has.
pub fn read(text: &str) -> Result<CameraFile, Error> {
    let json = |error: serde_json::Error| Error::Json { why: error.to_string() };
    let file: serde_json::Value = serde_json::from_str(text).map_err(json)?;
    let camera = file.get("camera").filter(|camera| !camera.is_null());
    let inside = camera.unwrap_or(&file);
    let intrinsics: Intrinsics = match inside.get("intrinsics") {
        Some(intrinsics) => serde_json::from_value(intrinsics.clone()).map_err(json)?,
        None => serde_json::from_value::<Flat>(inside.clone()).map_err(json)?.into(),
    };
    let place = inside.get("world_from_camera").or_else(|| file.get("world_from_camera"));
    let world_from_camera = match place.filter(|place| !place.is_null()) {
        Some(place) => Some(serde_json::from_value(place.clone()).map_err(json)?),
        None => None,
    };
    for (what, value) in [("fx", intrinsics.fx), ("fy", intrinsics.fy)] {
        if !(value > 0.0 && value.is_finite()) {
            return Err(Error::Number { what, value });
        }
    }
    let (k, model) = (&intrinsics, intrinsics.model);
    let foreign = match model {
        LensModel::Brown => [("k4", k.k4), ("k4", 0.0)],
        LensModel::Fisheye => [("p1", k.p1), ("p2", k.p2)],
    };
    if let Some((term, _)) = foreign.into_iter().find(|(_, value)| *value != 0.0) {
        return Err(Error::Term { term, model });
    }
    Ok(CameraFile { intrinsics, world_from_camera })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_three_forms_are_one_camera() {
        let pose = r#""world_from_camera": {"xyz_m": [0,0,1], "quat_wxyz": [1,0,0,0]}"#;
        let flat =
            r#""fx_px": 800, "cx_px": 319.5, "cy_px": 239.5, "k1": -0.2, "image_px": [640, 480]"#;
        let full = r#""intrinsics": {"fx": 800, "fy": 800, "cx": 319.5, "cy": 239.5, "skew": 0, "k1": -0.2,
            "k2": 0, "width": 640, "height": 480}"#;
        let camera = |text: String| read(&text).unwrap();
        let a = camera(format!("{{\"camera\": {{{full}, {pose}}}}}"));
        assert_eq!(a, camera(format!("{{\"camera\": {{{flat}}}, {pose}}}")));
        assert_eq!(a, camera(format!("{{{flat}, {pose}}}")));
        let bare = camera(format!("{{{flat}}}"));
        assert_eq!((bare.intrinsics, bare.world_from_camera), (a.intrinsics, None));
    }

    #[test]
    fn a_fisheye_says_so_and_has_no_terms_of_another_lens() {
        let text = |more: &str| {
            format!("{{\"fx_px\": 300, \"cx_px\": 319.5, \"cy_px\": 239.5, \"k1\": 0.05{more}}}")
        };
        let file = read(&text(r#", "k4": 0.01, "model": "fisheye""#)).unwrap();
        assert_eq!((file.intrinsics.model, file.intrinsics.k4), (LensModel::Fisheye, 0.01));
        let written =
            serde_json::json!({ "camera": { "intrinsics": file.intrinsics } }).to_string();
        assert_eq!(read(&written).unwrap(), file);
        for wrong in
            [r#", "k4": 0.01"#, r#", "p1": 0.01, "model": "fisheye""#, r#", "model": "fish""#]
        {
            assert!(read(&text(wrong)).is_err(), "{wrong}");
        }
    }

    #[test]
    fn what_no_camera_has_is_refused() {
        for text in ["", "[]", "{}", "{\"camera\": 3}", r#"{"fx_px": -1, "cx_px": 0, "cy_px": 0}"#]
        {
            assert!(read(text).is_err(), "{text}");
        }
    }
}
