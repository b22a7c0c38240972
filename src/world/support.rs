//! What a thing stands on, or would fall onto: the table or another thing, told from shapes and poses alone.
//!
//! A thing stands over its support with the middle of its base. Whether it stays there is for physics to say.

use super::frame::{Object as ObjectFrame, World};
use super::object::{Object, Shape};
use super::{ObjectState, Pose, Scene};

/// What is this far above a base may still be what it stands on, m: as far as a thing is known to be off when it has
/// been put on another by a hand (8 to 19 mm in `docs/results.md`).
const SUNK: f64 = 0.015;
/// What leans further than this bears nothing, rad: 20 deg, the slope on which plastic slides on wood.
const LEANS: f64 = 20.0 * std::f64::consts::PI / 180.0;

/// What is below a thing.
#[derive(Debug, Clone, PartialEq)]
pub struct Support {
    /// Its name; `None` is the table.
    pub name: Option<String>,
    /// How high its top, or its inside floor, is above the table, m.
    pub height: f64,
    /// How far inside its side the middle of the base is, m; infinite on the table.
    pub inset: f64,
}

/// Returns what is below the base of `o`, which stands or hangs at `pose`.
pub fn below(
    scene: &Scene,
    objects: &[ObjectState],
    o: &Object,
    pose: &Pose<World, ObjectFrame>,
) -> Support {
    let base = pose.origin();
    let bears = scene.objects.iter().filter(|other| other.name != o.name).filter_map(|other| {
        let known = objects.iter().find(|known| known.name == other.name)?;
        let (height, inset) = top_of(other, &known.world_from_object?, o, base)?;
        let name = Some(other.name.clone());
        (height <= base.z + SUNK).then_some(Support { name, height, inset })
    });
    let table = Support { name: None, height: 0.0, inset: f64::INFINITY };
    bears.fold(table, |highest, next| if next.height > highest.height { next } else { highest })
}

/// Returns a thing and what it stands on or in, and that in turn, by name, the table aside: the thing first, as far as places are known.
pub fn pile(scene: &Scene, objects: &[ObjectState], name: &str) -> Vec<String> {
    let next = |on: &String| {
        let pose = objects.iter().find(|known| known.name == *on)?.world_from_object?;
        below(scene, objects, scene.object(on)?, &pose).name
    };
    // A pile is no higher than there are things.
    std::iter::successors(Some(name.to_owned()), next).take(scene.objects.len()).collect()
}

/// Returns how high `other` bears `o` with its base at `base`, and how far inside its side that is, m; `None` when it is
/// not below it.
fn top_of(
    other: &Object,
    pose: &Pose<World, ObjectFrame>,
    o: &Object,
    base: nalgebra::Vector3<f64>,
) -> Option<(f64, f64)> {
    if pose.tilt() > LEANS {
        return None;
    }
    let local = pose.isometry().inverse_transform_point(&base.into());
    let inset = other.shape.inset(local.x, local.y);
    if inset < 0.0 {
        return None;
    }
    let floor = other
        .inside()
        .filter(|inside| fits(o, inside))
        .map(|inside| other.shape.height() - inside.height());
    Some((pose.origin().z + floor.unwrap_or_else(|| other.shape.height()), inset))
}

/// Whether a vessel at `pose` has `o` inside, with its base at `base`.
pub fn holds(
    vessel: &Object,
    pose: &Pose<World, ObjectFrame>,
    o: &Object,
    base: nalgebra::Vector3<f64>,
) -> bool {
    vessel.inside().is_some_and(|inside| fits(o, &inside))
        && top_of(vessel, pose, o, base).is_some_and(|(floor, _)| floor <= base.z + SUNK)
}

/// Whether a thing goes into a space whichever way it is turned about the vertical.
pub fn fits(o: &Object, inside: &Shape) -> bool {
    o.shape.outer_radius() <= inside.inner_radius()
}

#[cfg(test)]
mod tests {
    use super::super::object::vessel;
    use super::*;

    fn named(name: &str, shape: Shape) -> Object {
        Object { name: name.into(), cavity: None, ..vessel(shape, 1e-3) }
    }

    fn cube(name: &str, side: f64) -> Object {
        named(name, Shape::Cuboid { size: nalgebra::Vector3::new(side, side, side) })
    }

    #[test]
    fn a_thing_stands_on_the_highest_thing_below_its_middle() {
        let bowl = Object {
            name: "bowl".into(),
            ..vessel(Shape::Cylinder { radius: 0.08, height: 0.06 }, 1e-3)
        };
        let scene = crate::world::scene::bare(vec![cube("low", 0.06), cube("high", 0.04), bowl]);
        let at = |name: &str, x: f64, z: f64| ObjectState {
            name: name.into(),
            world_from_object: Some(Pose::upright(x, 0.0, z, 0.3)),
            std: 0.001,
            water: None,
        };
        let objects = [at("low", 0.5, 0.0), at("high", 0.51, 0.061), at("bowl", 0.8, 0.0)];
        let of = |name: &str, x: f64, z: f64| {
            below(&scene, &objects, scene.object(name).unwrap(), &Pose::upright(x, 0.0, z, 0.0))
        };
        let on_low = of("high", 0.51, 0.061);
        assert_eq!((on_low.name.as_deref(), on_low.height), (Some("low"), 0.06));
        // The low cube is turned by 0.3 rad, and the middle is 1 cm aside.
        assert!((on_low.inset - (0.03 - 0.01 * 0.3_f64.cos())).abs() < 1e-12, "{on_low:?}");
        assert_eq!(of("high", 0.51, 0.2).name.as_deref(), Some("low"), "it would fall onto it");
        let on_table = Support { name: None, height: 0.0, inset: f64::INFINITY };
        assert_eq!(of("high", 0.60, 0.2), on_table);
        assert_eq!(of("low", 0.5, 0.0).name, None, "what is above does not bear");
        // In the bowl, on its floor; what is too wide stands on its rim.
        let inside = of("high", 0.8, 0.05);
        assert_eq!(inside.name.as_deref(), Some("bowl"));
        assert!((inside.height - 0.003).abs() < 1e-12);
        let (bowl, high) = (scene.object("bowl").unwrap(), scene.object("high").unwrap());
        let has = |z: f64| {
            let base = nalgebra::Vector3::new(0.8, 0.0, 0.003);
            holds(bowl, &Pose::upright(0.8, 0.0, z, 0.0), high, base)
        };
        assert!(has(0.0));
        assert!(!has(0.045), "it stands on the cube");
        let wide = cube("wide", 0.2);
        let on = below(&scene, &objects, &wide, &Pose::upright(0.8, 0.0, 0.06, 0.0));
        assert!((on.height - 0.06).abs() < 1e-12);
    }
}
