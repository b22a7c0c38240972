//! Links that are near to each other wherever the arm is, for `robot check`: which, how often, and what to write.

use crate::motion::collision::{CollisionWorld, Contact, Contacts};

/// Random positions of the joints that are asked for self-contact. Chosen: a share is known to 4 in 100.
const POSITIONS: usize = 200;
/// Links that are nearer than this, m, are near: less is kept around an arm by few who plan for one.
const NEAR: f64 = 0.005;

/// Returns what is found of each pair of links that are near to each other at half of the positions or more, and what to write:
/// as a rule it is their shapes that are, and few plans are found.
pub(super) fn near_itself(world: &CollisionWorld<'_>) -> Vec<(String, String)> {
    let Contacts { free, pairs } = world.contacts(POSITIONS, NEAR);
    let often = pairs.into_iter().filter(|pair| 2 * pair.near >= POSITIONS);
    let told = often.map(|Contact { links: [first, second], near, touching, least }| {
        let deepest = if touching > 0 {
            format!("overlap at {touching}, by up to {:.1} mm", -1e3 * least)
        } else {
            format!("are never nearer than {:.1} mm", 1e3 * least)
        };
        let found = format!(
            "{first} and {second} are within {:.0} mm of each other at {near} of {POSITIONS} random positions and {deepest}: \
             plans that keep a distance are refused; {free} of {POSITIONS} are free of self-contact",
            1e3 * NEAR
        );
        let write = format!(
            "shapes of {first} and {second} that are nearer to the real ones, or, where the arm's never touch, [[unchecked]] link = \"{first}\" with = [\"{second}\"] in robot.toml"
        );
        (found, write)
    });
    told.collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motion::robot::Robot;

    /// Of an iiwa whose shapes of links 5 and 7 nearly touch everywhere nothing was told, and plans were refused.
    #[test]
    fn a_pair_that_is_near_wherever_the_arm_is_is_told() {
        let told = |gap: f64| {
            let link = |name: &str, radius: f64| {
                format!(
                    "<link name=\"{name}\"><collision><geometry><sphere radius=\"{radius}\"/></geometry></collision></link>"
                )
            };
            let joint = |name: &str, from: &str, to: &str, z: f64| {
                format!(
                    "<joint name=\"{name}\" type=\"revolute\"><parent link=\"{from}\"/><child link=\"{to}\"/><origin xyz=\"0 0 {z}\"/>
                    <axis xyz=\"0 0 1\"/><limit lower=\"-2\" upper=\"2\" velocity=\"1\" effort=\"1\"/></joint>"
                )
            };
            let text = format!(
                "<robot name=\"arm\">{}{}{}{}{}</robot>",
                link("a", 0.1),
                link("b", 0.01),
                link("c", 0.1),
                joint("j", "a", "b", 0.1),
                joint("k", "b", "c", 0.1 + gap)
            );
            let robot = Robot::from_urdf(&text, None).unwrap();
            near_itself(&CollisionWorld::new(&robot))
        };
        let near = told(0.003);
        let [(found, write)] = &near[..] else { panic!("{near:?}") };
        assert!(found.contains("a and c are within 5 mm of each other at 200 of 200"), "{found}");
        assert!(found.contains("never nearer than 3.0 mm"), "{found}");
        assert!(found.contains("200 of 200 are free of self-contact"), "{found}");
        assert!(write.contains("[[unchecked]] link = \"a\" with = [\"c\"]"), "{write}");
        assert!(told(0.02).is_empty());
    }
}
