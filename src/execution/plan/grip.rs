//! Where two fingers hold a thing: from which directions, how high, and how wide they must open.
//!
//! In: a shape as it stands. Out: grips, each with the direction of approach, the height and the middle between the
//! fingers. Whether an arm gets there is [`super::grasp`]'s.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI, TAU};

use nalgebra::Vector2;

use crate::world::{Mesh, Mug, Shape};

/// Where along its height an object is taken, as shares of it, in the order they are tried. Chosen: below half of the
/// height the wrist is near the table and the thing hangs top-heavy; above two thirds the pads, 22 mm high, come near
/// the lip of what is low.
pub(super) const SHARES_UP: [f64; 3] = [0.60, 0.52, 0.68];
/// Where a thing whose radius changes may be taken: from this share of its height, in steps. Chosen: from a third, below
/// which it hangs over, to nine tenths, above which the pads pass its top.
const LOWEST_SHARE: f64 = 0.36;
const SHARE_STEP: f64 = 0.06;
const SHARES: i32 = 8;
/// Slopes of a side that differ by less are held alike, no unit. Chosen: 6 deg; a cup that opens upwards by 3 deg was taken
/// and poured at any height, a skittle by a side of 14 deg leant in the hand and fell.
const SLOPES: f64 = 0.1;
/// Half the height of the pads of the fingers, m: those of a 2F-85 are 22 mm high.
const PAD: f64 = 0.011;
/// Half of how wide fingers are, m: those of a 2F-85 are 22 mm wide; and the room that is left between them and a handle. Half
/// of the room is what a thing is seen beside its place.
const THICK: f64 = 0.011;
const CLEAR: f64 = 0.004;
/// Places along a handle at which it is asked whether a finger is there: 4 mm apart on a handle of 3 cm.
const PLACES: i32 = 8;
/// In so many steps to either side of the middle of a finger it is asked how wide a round thing is: of a 2F-85's 8 mm apart.
const GIRTHS: i32 = 4;
/// Directions from which a round object is approached. Chosen: 22.5 deg apart. With eight a table corner may hide all
/// that are free; with 32 each costs as much again and two neighbours touch the same things.
const AROUND_CYLINDER: i32 = 16;

/// Where two fingers hold a thing that stands, in its own frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Grip {
    /// The direction from which the hand comes, rad about z.
    pub(super) heading: f64,
    /// The middle between the fingers, m.
    pub(super) middle: Vector2<f64>,
    /// How far apart the fingers are when they touch, m.
    pub(super) width: f64,
}

/// Returns how two fingers that reach `ahead` m past the tool point, of a hand that points down by `pitch` rad, hold a shape at a
/// height, m, whether they open so wide or not.
pub(super) fn at_height(shape: &Shape, height: f64, pitch: f64, ahead: f64) -> Vec<Grip> {
    let middle = Vector2::zeros();
    // Half of the heights that a finger covers: a level one its pad's, one that points down its length.
    let reach = ahead * pitch.sin() + PAD * pitch.cos();
    match shape {
        Shape::Cuboid { size } => {
            // Moving along the object's x the fingers close on its y faces, and the other way round.
            let faces = [(0.0, size.y), (FRAC_PI_2, size.x)];
            let both = faces.iter().flat_map(|(turn, width)| {
                [*turn, turn + PI].map(|heading| Grip { heading, middle, width: *width })
            });
            both.collect()
        }
        Shape::Cylinder { .. } | Shape::Lathe { .. } => {
            let width = girth(shape, height, reach);
            let heading = |i: i32| f64::from(i) * TAU / f64::from(AROUND_CYLINDER);
            (0..AROUND_CYLINDER).map(|i| Grip { heading: heading(i), middle, width }).collect()
        }
        Shape::Mesh { mesh } => of_mesh(mesh, height, reach),
        Shape::Mug { mug } => at_height(&shape.body(), height, pitch, ahead)
            .into_iter()
            .filter(|grip| !meets_handle(mug, grip.heading, pitch, ahead))
            .collect(),
    }
}

/// Returns the smallest width at which a shape is held anywhere that is tried, m; `None` where fingers find no two sides.
pub(super) fn narrowest(shape: &Shape) -> Option<f64> {
    let shares = shares_up(shape).into_iter();
    let widths = shares.flat_map(|up| at_height(shape, up * shape.height(), 0.0, 0.0));
    widths.map(|grip| grip.width).min_by(f64::total_cmp)
}

/// Whether a finger would be where a mug's handle is: beside the wall, from the palm to its tip.
fn meets_handle(mug: &Mug, heading: f64, pitch: f64, finger: f64) -> bool {
    let (middle, half) = mug.around_handle();
    // A hand that points down has its fingers upright; a level one has them along its heading.
    let ahead = finger * pitch.cos() + THICK * pitch.sin();
    (0..=PLACES).any(|k| {
        let out = middle.x + half.x * (2.0 * f64::from(k) / f64::from(PLACES) - 1.0);
        let (along, aside) = (out * heading.cos(), -out * heading.sin());
        let room = half.y + CLEAR;
        let is_aside = aside.abs() + room > mug.sizes().radius;
        let from = if pitch < FRAC_PI_4 { f64::NEG_INFINITY } else { -ahead };
        is_aside && along > from - room && along < ahead + room
    })
}

fn of_mesh(mesh: &Mesh, height: f64, reach: f64) -> Vec<Grip> {
    let held = mesh.axes().into_iter().filter_map(|axis| mesh.between(height, reach, axis));
    held.flat_map(|between| {
        [-FRAC_PI_2, FRAC_PI_2].map(|turn| Grip {
            heading: between.axis + turn,
            middle: between.middle,
            width: between.width,
        })
    })
    .collect()
}

/// Returns where along its height an object is taken, as shares of it: of a thing whose radius changes where its side is
/// steepest, for on a slope the pads touch along a line and the thing leans; of a mesh also where it may be narrower.
pub(super) fn shares_up(shape: &Shape) -> Vec<f64> {
    let all = (0..=SHARES).map(|k| LOWEST_SHARE + f64::from(k) * SHARE_STEP);
    match shape {
        Shape::Cuboid { .. } | Shape::Cylinder { .. } | Shape::Mug { .. } => SHARES_UP.to_vec(),
        Shape::Mesh { .. } => SHARES_UP.into_iter().chain(all).collect(),
        Shape::Lathe { profile } => {
            let slope = |share: f64| {
                let z = share * profile.height();
                let slopes = [-PAD, 0.0, PAD].map(|up| profile.slope_at(z + up).abs());
                // What differs by less than a pad gives way is alike; then as near to where others are taken as can be.
                let steps = (slopes.into_iter().fold(0.0, f64::max) / SLOPES).floor();
                (steps, (share - SHARES_UP[0]).abs())
            };
            let mut shares: Vec<f64> = all.collect();
            shares.sort_by(|a, b| {
                slope(*a).partial_cmp(&slope(*b)).unwrap_or(std::cmp::Ordering::Equal)
            });
            shares.truncate(SHARES_UP.len());
            shares
        }
    }
}

/// Returns how wide a round thing is between fingers that cover the heights within `reach` of `height`, m.
fn girth(shape: &Shape, height: f64, reach: f64) -> f64 {
    match shape {
        Shape::Lathe { profile } => {
            let heights = (-GIRTHS..=GIRTHS).map(|k| f64::from(k) / f64::from(GIRTHS) * reach);
            2.0 * heights.map(|up| profile.radius_at(height + up)).fold(0.0, f64::max)
        }
        _ => 2.0 * shape.inner_radius(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;

    /// A 2F-85's, m.
    const FINGER: f64 = 0.032;

    #[test]
    fn a_box_is_held_by_its_faces_and_a_can_from_all_round() {
        let size = Vector3::new(0.12, 0.06, 0.1);
        let grips = at_height(&Shape::Cuboid { size }, 0.05, 0.0, FINGER);
        assert_eq!(grips.len(), 4);
        assert!((grips[0].width - 0.06).abs() < 1e-12 && grips[0].heading == 0.0);
        let can = Shape::Cylinder { radius: 0.03, height: 0.1 };
        assert_eq!(at_height(&can, 0.05, 0.0, FINGER).len(), 16);
        assert!((narrowest(&can).unwrap() - 0.06).abs() < 1e-12);
    }

    #[test]
    fn fingers_from_above_stay_off_what_flares_below() {
        // An upright wall of 16 mm on a foot, with a slope between them from 14 to 26 mm.
        let outline =
            [(0., 0.), (80., 0.), (80., 14.), (28., 14.), (16., 26.), (16., 74.), (0., 74.)];
        let bracket = crate::world::mesh::drawn_out(&outline, 44.0);
        let bracket = Mesh::new("bracket.stl", &bracket, 1e-3).unwrap();
        let shape = Shape::Mesh { mesh: std::sync::Arc::new(bracket) };
        let at = |height: f64, pitch: f64| at_height(&shape, height, pitch, FINGER);
        let across = |grips: Vec<Grip>| grips.iter().any(|grip| (grip.width - 0.016).abs() < 1e-9);
        assert!(across(at(0.045, 0.0)), "level, the pads are above the slope");
        assert!(!across(at(0.045, FRAC_PI_2)), "the tips would be on the slope");
        assert!(across(at(0.062, FRAC_PI_2)));
    }

    #[test]
    fn a_mug_is_held_from_where_its_handle_is_in_nobodys_way() {
        let sizes =
            crate::world::mug::Sizes { radius: 0.036, height: 0.095, handle: 0.03, thick: 0.01 };
        let mug = Shape::Mug { mug: std::sync::Arc::new(Mug::new(sizes).unwrap()) };
        let from = |pitch: f64| -> Vec<i32> {
            let grips = at_height(&mug, 0.05, pitch, FINGER);
            grips.iter().map(|grip| grip.heading.to_degrees().round() as i32).collect()
        };
        // Level: towards the handle, or with it between the fingers; from above: everywhere but with a finger on it.
        let level = from(0.0);
        assert!(level.contains(&0) && level.contains(&180), "{level:?}");
        assert!(level.iter().all(|h| (h % 180) <= 45 || (h % 180) >= 135), "{level:?}");
        let above = from(FRAC_PI_2);
        assert!(above.contains(&0) && above.contains(&180) && !above.contains(&90), "{above:?}");
    }

    #[test]
    fn a_cone_that_is_steeper_than_pads_hold_is_held_where_it_is_steepest() {
        let bottle = [[0.032, 0.0], [0.032, 0.095], [0.013, 0.13], [0.014, 0.16]];
        let profile = crate::world::Profile::new(&bottle).unwrap();
        let shape = Shape::Lathe { profile };
        assert_eq!(shares_up(&shape).len(), 3);
        assert!(shares_up(&shape).iter().all(|up| up * 0.16 < 0.095 - PAD));
    }
}
