//! `robot check`: what a robot's files say, and what is missing for kinematics, planning, the twin and a pour.
//!
//! A robot in, findings out; every finding that is not in order says what to write. What is checked is what the other
//! layers ask of a robot: no rule of theirs is repeated here, they are asked.

use std::f64::consts::TAU;

use nalgebra::{Isometry3, Vector3};

use super::finding::{CheckAnswer, Finding, State, Use};
use super::left_out::parts;
use super::robot_contacts::near_itself;
use super::robot_reach::{Reach, reach};
use crate::execution::calibrate::DOUBT;
use crate::motion::collision::{CollisionWorld, Obstacle};
use crate::motion::fault::{Note, said_of_opening};
use crate::motion::ik::Solver;
use crate::motion::robot::{Drive, Motion, Robot};
use crate::motion::solid::Solid;

/// Directions further from parallel than this are another axis: the cosine of 2.5 deg.
const ALONG: f64 = 0.999;
/// A joint that may turn farther than this from zero, rad, has its range in degrees, as a rule.
const MANY_TURNS: f64 = 5.0 * TAU;

/// What the table is called among obstacles.
pub(super) const TABLE: &str = "table";

/// Answers `robot check`; `tell` hears what is looked at next, after how many of how many.
pub fn check<'a>(robot: &'a Robot, tell: &mut dyn FnMut(&'static str, [usize; 2])) -> CheckAnswer {
    let mut list = List { robot, checks: Vec::new() };
    let looks: [(&str, Look<'a>); 11] = [
        ("joints", List::joints),
        ("limits", List::limits),
        ("shapes", List::shapes),
        ("pairs", List::pairs),
        ("masses", List::masses),
        ("mimic", List::coupled),
        ("jaws", List::jaws),
        ("tool", List::tool),
        ("marker", List::marker),
        ("poses", List::poses),
        ("reach", List::reach),
    ];
    let n = looks.len();
    for (done, (what, look)) in looks.into_iter().enumerate() {
        tell(what, [done, n]);
        look(&mut list);
    }
    let blocked = |to: Use| {
        list.checks.iter().any(|check| check.state == State::Missing && check.needed_for <= to)
    };
    let all = [Use::Kinematics, Use::Planning, Use::Twin, Use::Pour];
    let usable_for = all.into_iter().filter(|to| !blocked(*to)).collect();
    CheckAnswer { robot: robot.name().to_owned(), usable_for, checks: list.checks }
}

/// One look at a robot.
type Look<'a> = fn(&mut List<'a>);

struct List<'a> {
    robot: &'a Robot,
    checks: Vec<Finding>,
}

impl List<'_> {
    fn add(&mut self, name: &'static str, needed_for: Use, found: impl Into<String>) {
        let found = found.into();
        self.checks.push(Finding { name, state: State::Ok, needed_for, found, write: None });
    }

    fn wrong(
        &mut self,
        (name, state, needed_for): (&'static str, State, Use),
        found: impl Into<String>,
        write: impl Into<String>,
    ) {
        let (found, write) = (found.into(), Some(write.into()));
        self.checks.push(Finding { name, state, needed_for, found, write });
    }

    fn joints(&mut self) {
        let robot = self.robot;
        let (root, tip) = (&robot.links()[0].name, &robot.links()[robot.tip()].name);
        let n = robot.n_joints();
        self.add("joints", Use::Kinematics, format!("{n} from {root} to {tip}"));
        let how = if Solver::new(robot).is_analytic() {
            "solved in closed form, every branch"
        } else {
            "solved numerically, from many starts"
        };
        self.add("kinematics", Use::Kinematics, how);
    }

    /// Ranges, speeds, accelerations and torques of the joints.
    fn limits(&mut self) {
        let robot = self.robot;
        let joints = robot.joints();
        let names = |wrong: &dyn Fn(usize) -> bool| {
            let names = (0..joints.len()).filter(|&i| wrong(i)).map(|i| joints[i].name.as_str());
            names.collect::<Vec<_>>().join(", ")
        };
        let noted = |of: &dyn Fn(&Note) -> Option<&String>| {
            robot.notes().iter().filter_map(of).map(String::as_str).collect::<Vec<_>>().join(", ")
        };
        let open = noted(&|note| match note {
            Note::NoRange { joint } => Some(joint),
            _ => None,
        });
        let wide = names(&|i| {
            let joint = &joints[i];
            let turns = robot.links()[joint.link].joint.motion == Motion::Turn;
            let most = joint.upper.max(-joint.lower);
            turns && !joint.continuous && most.is_finite() && most > MANY_TURNS
        });
        if !wide.is_empty() {
            let found =
                format!("ends more than five turns from zero, as of degrees read as rad: {wide}");
            let write = "<limit lower=\"..\" upper=\"..\"/> in rad, or type=\"continuous\"";
            self.wrong(("ranges", State::Assumed, Use::Planning), found, write);
        } else if open.is_empty() {
            self.add("ranges", Use::Planning, "every joint has one, or turns without end");
        } else {
            let write = "<limit lower=\"..\" upper=\"..\"/> (rad) in these joints of the URDF";
            self.wrong(("ranges", State::Assumed, Use::Planning), format!("none: {open}"), write);
        }
        let slow = noted(&|note| match note {
            Note::NoSpeed { joint } => Some(joint),
            _ => None,
        });
        if slow.is_empty() {
            self.add("speeds", Use::Planning, "every joint has a limit");
        } else {
            let found = format!("1 rad/s for {slow}, which have none");
            let write = "<limit velocity=\"..\"/> (rad/s) in these joints of the URDF";
            self.wrong(("speeds", State::Assumed, Use::Planning), found, write);
        }
        if robot.states_accelerations() {
            self.add("accelerations", Use::Planning, "every joint has a limit");
        } else {
            let sliding = robot.sliding();
            let slides_any = sliding.contains(&true);
            let unit_of = |slides: bool| if slides { " m/s^2" } else { " rad/s^2" };
            // One unit for all is told behind the last.
            let each = joints.iter().zip(&sliding).map(|(joint, slides)| {
                let unit = if slides_any { unit_of(*slides) } else { "" };
                format!("{:.1}{unit}", joint.acceleration)
            });
            let each = each.collect::<Vec<_>>().join(", ");
            let unit = if slides_any { "" } else { unit_of(false) };
            let found = format!("full speed in 0.25 s: {each}{unit}");
            let m = if slides_any { ", in m/s^2 of what slides," } else { "" };
            let n = joints.len();
            let write = format!("max_acceleration_rad_s2 = [{n} numbers]{m} in robot.toml");
            self.wrong(("accelerations", State::Assumed, Use::Planning), found, write);
        }
        let strong = names(&|i| joints[i].effort.is_infinite());
        if strong.is_empty() {
            self.add("torques", Use::Twin, "every joint has a limit");
        } else {
            let write = "<limit effort=\"..\"/> (N*m) in these joints of the URDF";
            self.wrong(
                ("torques", State::Assumed, Use::Twin),
                format!("no limit: {strong}"),
                write,
            );
        }
    }

    /// Collision shapes, and the meshes that make none.
    fn shapes(&mut self) {
        let robot = self.robot;
        let bodies = parts(robot);
        let links = robot.links();
        let is_left_out = |name: &str| {
            robot.notes().iter().any(|note| matches!(note, Note::Mesh { link, .. } if link == name))
        };
        // A part without any shape, and whatever moves and has none but meshes that are left out.
        let is_bare = |link: usize| {
            let mut parts = bodies.iter().filter(|body| body[0] == link);
            parts.any(|body| body.iter().all(|&link| links[link].collision.is_empty()))
                || (robot.carrier(link) != 0 && is_left_out(&links[link].name))
        };
        let bare: Vec<&str> = (0..links.len())
            .filter(|&link| links[link].collision.is_empty() && is_bare(link))
            .map(|link| links[link].name.as_str())
            .collect();
        let solids: usize = robot.links().iter().map(|link| link.collision.len()).sum();
        let write = "<collision> with a box, cylinder or sphere, or a mesh in STL or OBJ";
        if solids == 0 {
            let found = "no link has a collision shape that is read";
            self.wrong(("shapes", State::Missing, Use::Planning), found, write);
        } else if bare.is_empty() {
            self.add("shapes", Use::Planning, format!("{solids} solids, on every moving part"));
        } else {
            let found = format!("{solids} solids; none on {}", bare.join(", "));
            self.wrong(("shapes", State::Assumed, Use::Planning), found, write);
        }
        for note in robot.notes() {
            if let Note::Mesh { link, file, what } = note {
                let found = format!("{link}: {file} is left out: {what}");
                self.wrong(("mesh", State::Assumed, Use::Planning), found, write);
            }
        }
    }

    /// Pairs of links that are not checked, and whether the named poses are free of the others.
    fn pairs(&mut self) {
        let robot = self.robot;
        if robot.has_side_file() {
            let found = format!("{} pairs of links are not checked", robot.unchecked().len());
            self.add("pairs", Use::Planning, found);
        } else {
            let found = "pairs that touched at 95 of 100 random positions are not checked";
            let write = "[[unchecked]] link = \"a\" with = [\"b\"] in robot.toml, for pairs that never touch";
            self.wrong(("pairs", State::Assumed, Use::Planning), found, write);
        }
        let world = CollisionWorld::new(robot);
        for (found, write) in near_itself(&world) {
            self.wrong(("self_contact", State::Assumed, Use::Planning), found, write);
        }
        for (name, q) in robot.poses().iter().filter(|(_, q)| q.len() == robot.n_joints()) {
            if let Ok(nearest) = world.clearance(q)
                && nearest.distance <= 0.0
            {
                let (first, second) = (nearest.first, nearest.second);
                let found = format!(
                    "at `{name}` {first} and {second} overlap by {:.1} mm: nothing is planned from there",
                    -1e3 * nearest.distance
                );
                let write = "another pose, or smaller shapes, or the pair into [[unchecked]]";
                // From elsewhere the arm is planned for as well; a run begins at `home`.
                self.wrong(("self_collision", State::Missing, Use::Pour), found, write);
            }
        }
    }

    /// Masses of what the joints carry.
    fn masses(&mut self) {
        let robot = self.robot;
        let light: Vec<&str> = parts(robot)
            .iter()
            .filter(|body| body.iter().all(|&link| robot.links()[link].inertial.is_none()))
            .map(|body| robot.links()[body[0]].name.as_str())
            .collect();
        let masses = robot.links().iter().filter_map(|link| link.inertial).map(|own| own.mass);
        let kg = masses.fold(0.0, |sum, mass| sum + mass);
        // Of what weighs nothing nobody asks how it resists turning.
        let heavy = robot.links().iter().filter_map(|link| Some((link, link.inertial?)));
        let odd: Vec<_> = heavy.filter(|(_, own)| own.mass > 0.0 && !own.is_of_a_body()).collect();
        if !odd.is_empty() {
            let is_worse =
                odd.iter().any(|(_, own)| own.inertia.symmetric_eigenvalues().min() < 0.0);
            let state = if is_worse { State::Missing } else { State::Assumed };
            let names: Vec<&str> = odd.iter().map(|(link, _)| link.name.as_str()).collect();
            let found = format!("no body has the inertia of {}", names.join(", "));
            let write =
                "moments above 0 kg·m², each at most the sum of the other two, into <inertia>";
            self.wrong(("inertias", state, Use::Twin), found, write);
        }
        if !light.is_empty() {
            let found = format!("{kg:.2} kg; none on {}", light.join(", "));
            let write = "<inertial> with <mass> and <inertia> into these links of the URDF";
            self.wrong(("inertias", State::Missing, Use::Twin), found, write);
        } else if odd.is_empty() {
            self.add("inertias", Use::Twin, format!("{kg:.2} kg, on every moving part"));
        }
    }

    /// Joints that follow the arm's, on the way to the tip or beside it, which the physics cannot couple.
    fn coupled(&mut self) {
        let robot = self.robot;
        let driven =
            robot.links().iter().filter(|l| matches!(l.joint.drive, Drive::Joint { .. })).count();
        if driven != robot.n_joints() {
            let found = format!("{} joints mimic joints of the arm", driven - robot.n_joints());
            let write = "a joint each in the place of <mimic>; the twin couples jaws only";
            self.wrong(("mimic", State::Missing, Use::Twin), found, write);
        }
    }

    fn jaws(&mut self) {
        let robot = self.robot;
        let jaws = robot.jaws().count();
        let coupled = robot.notes().iter().find(|note| matches!(note, Note::Coupled { .. }));
        let idle = |note: &Note| match note {
            Note::OffPath { joint } => Some(joint.clone()),
            _ => None,
        };
        let idle: Vec<String> = robot.notes().iter().filter_map(idle).collect();
        let write = "two fingers on prismatic joints, or on revolute ones, the second with <mimic joint=\"the first\"/>";
        let kind = ("jaws", State::Missing, Use::Twin);
        if jaws != 2 {
            let besides = if idle.is_empty() {
                String::new()
            } else {
                format!("; joints beside the arm that nothing moves: {}", idle.join(", "))
            };
            self.wrong(kind, format!("{jaws} jaws that slide{besides}"), write);
            return;
        }
        if robot.pair().is_none() {
            self.wrong(kind, "the two jaws do not move apart alike", write);
            return;
        }
        let mm = 1e3 * robot.max_opening();
        if robot.max_opening() <= robot.min_opening() {
            let write = "<limit lower=\"..\" upper=\"..\"/> of both fingers (m) so that both can move apart";
            self.wrong(
                kind,
                format!("2, whose ranges let them stand {mm:.0} mm open alone"),
                write,
            );
            return;
        }
        let [least, most] =
            [robot.min_opening(), robot.max_opening()].map(|m| (1e3 * m).round() as u32);
        match coupled {
            Some(note) => self.add("jaws", Use::Twin, note.to_string()),
            None => {
                self.add(
                    "jaws",
                    Use::Twin,
                    format!("2, which open {}", said_of_opening(least, most)),
                );
            }
        }
        // The kitchen's jar is 65 mm wide, and needs 4 mm on each side.
        if mm < 73.0 {
            let found = format!("they open {mm:.0} mm; the kitchen's jar needs 73 mm");
            let write = "a scene with a narrower jar";
            self.wrong(("opening", State::Assumed, Use::Pour), found, write);
        }
    }

    /// The tool centre point: between the fingers, z ahead, the fingers opening along x.
    fn tool(&mut self) {
        let robot = self.robot;
        let tip = &robot.links()[robot.tip()].name;
        let kind = ("tool", State::Missing, Use::Pour);
        let Some(tool) = robot.tool() else {
            let write = format!(
                "tool = {{ link = \"{tip}\", xyz_m = [0, 0, ..], rpy_deg = [0, 0, ..] }} in robot.toml: the point between the fingertips, z ahead, fingers opening along x"
            );
            self.wrong(kind, "no tool centre point", write);
            return;
        };
        let rigid = robot.carrier(tool) == robot.carrier(robot.tip());
        let at = robot.flange_from_tool().origin();
        let found = format!("{:.0} mm from {tip}", 1e3 * at.norm());
        if !rigid {
            let write = "tool on a link that is fixed to the tip";
            self.wrong(kind, format!("it moves against {tip}"), write);
            return;
        }
        let zero = vec![0.0; robot.n_joints()];
        let place = |opening: f64| robot.link_poses(&zero, opening).ok();
        let (Some(jaw), Some(shut), Some(open)) =
            (robot.jaws().next(), place(0.0), place(robot.max_opening()))
        else {
            self.add("tool", Use::Pour, found);
            return;
        };
        let travel = open[jaw].translation.vector - shut[jaw].translation.vector;
        let along = open[tool].rotation.inverse() * travel.normalize();
        if along.x.abs() < ALONG {
            let found = format!(
                "the fingers open along ({:.2}, {:.2}, {:.2}) of the tool",
                along.x, along.y, along.z
            );
            let write = "rpy_deg of the tool in robot.toml so that they open along its x, z ahead";
            self.wrong(kind, found, write);
            return;
        }
        let (palm, tips) = (robot.palm().map_or(0.0, |palm| palm.z), robot.fingers_ahead());
        let tips = tips.unwrap_or(0.0);
        let reach = format!(
            "{found}; the palm is {:.0} mm behind it, the fingertips {:.0} mm ahead",
            -1e3 * palm,
            1e3 * tips
        );
        if palm < 0.0 && tips > 0.0 {
            self.add("tool", Use::Pour, reach);
        } else {
            let write = "xyz_m of the tool in robot.toml between palm and fingertips, along z";
            self.wrong(kind, reach, write);
        }
    }

    fn marker(&mut self) {
        let robot = self.robot;
        if let Some(marker) = robot.marker() {
            let (on, mm) = (&robot.links()[marker.link].name, 1e3 * marker.radius);
            self.add("marker", Use::Pour, format!("a ball of {mm:.0} mm radius on {on}"));
        } else {
            let found = "none: the camera does not see where the hand is (regression 3)";
            let write = "[marker] link = \"..\" centre_m = [..] radius_m = 0.014 colour_srgb = [208, 32, 143] in robot.toml";
            self.wrong(("marker", State::Missing, Use::Pour), found, write);
        }
    }

    /// The two poses that scripts name.
    fn poses(&mut self) {
        let robot = self.robot;
        for (name, what) in
            [("home", "where the arm begins"), ("retract", "where it hides nothing on the table")]
        {
            let kind = (name, State::Missing, Use::Pour);
            match robot.poses().get(name) {
                None => {
                    let n = robot.n_joints();
                    let write = format!("{name} = [{n} angles] under [poses_deg] in robot.toml");
                    self.wrong(kind, format!("no such pose: {what}"), write);
                }
                Some(q) => match robot.outside_limits(q, 1e-9) {
                    Some(i) => {
                        let found = format!("{} is outside its range", robot.joints()[i].name);
                        self.wrong(kind, found, "angles inside the ranges of the joints");
                    }
                    None if name == "home" => self.begins(q, what),
                    None => self.add(name, Use::Pour, what),
                },
            }
        }
    }

    /// Whether the arm can begin to move from `home`, over a table as high as its base: not calibrated yet it keeps more room.
    fn begins(&mut self, home: &[f64], what: &str) {
        let world = over_table(self.robot, DOUBT);
        let Ok(nearest) = world.clearance(home) else { return };
        if nearest.distance > 0.0 || nearest.second != TABLE {
            self.add("home", Use::Pour, what);
            return;
        }
        let (apart, kept) = (1e3 * (nearest.distance + DOUBT), 1e3 * DOUBT);
        let at = if apart < 0.0 {
            format!("{:.0} mm deep in", -apart)
        } else {
            format!("{apart:.0} mm from")
        };
        let found = format!(
            "{} is {at} a table as high as the base, and {kept:.0} mm are kept until the arm is calibrated: the first run cannot begin",
            nearest.first
        );
        let write = "a base that stands higher in the scene, `robot NAME at (x, y, z)`, or another home, or smaller shapes; \
                     `--without-regression 3` leaves the calibration out";
        self.wrong(("home", State::Missing, Use::Pour), found, write);
    }

    /// Whether a level hand comes to where jars stand.
    fn reach(&mut self) {
        let robot = self.robot;
        if robot.tool().is_none() {
            return;
        }
        let Reach { found, write } = reach(robot, &over_table(robot, 0.0));
        match write {
            Some(write) => self.wrong(("reach", State::Missing, Use::Pour), found, write),
            None => self.add("reach", Use::Pour, found),
        }
    }
}

/// Returns the robot over a table as high as its base, to which it is bolted, larger by `doubt` m on every side.
fn over_table(robot: &Robot, doubt: f64) -> CollisionWorld<'_> {
    let mut world = CollisionWorld::new(robot);
    let half = Vector3::new(1.0, 1.0, 0.01) + Vector3::repeat(doubt);
    let slab = Solid::Cuboid { half };
    world.add(&Obstacle::new(TABLE, slab, Isometry3::translation(0.5, 0.0, -0.01)));
    world.ignore(&robot.links()[0].name, TABLE);
    world.set_opening(robot.max_opening());
    world
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_range_in_degrees_is_told_and_one_in_radians_is_not() {
        let arm = |end: &str| {
            let text = format!(
                "<robot name=\"arm\"><link name=\"a\"/><link name=\"b\"/><joint name=\"j\" type=\"revolute\"><parent link=\"a\"/>
                <child link=\"b\"/><axis xyz=\"0 0 1\"/><limit lower=\"-{end}\" upper=\"{end}\" velocity=\"1\" effort=\"1\"/></joint></robot>"
            );
            let answer = check(&Robot::from_urdf(&text, None).unwrap(), &mut |_, _| {});
            let ranges = answer.checks.iter().find(|finding| finding.name == "ranges");
            ranges.map(|finding| finding.state)
        };
        assert_eq!([arm("170"), arm("6.28")], [Some(State::Assumed), Some(State::Ok)]);
    }
}
