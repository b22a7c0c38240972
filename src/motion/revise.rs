//! A robot's file with some of its numbers changed: links' inertial numbers, joints' origins. All else stays as it is written,
//! comments and order included; what comes out is read again and held against what was meant.
//!
//! Not a writer of URDFs: what is not changed is not touched.

use std::ops::Range;

use nalgebra::{Isometry3, Matrix3, Translation3, UnitQuaternion, Vector3};

use super::fault::UrdfFault;
use super::{Error, Inertial};

/// What is added to the inertial numbers of a link, about the link's own origin.
#[derive(Debug, Clone, PartialEq)]
pub struct LinkChange {
    /// Which link.
    pub link: String,
    /// kg.
    pub mass: f64,
    /// Mass times centre of mass, kg·m.
    pub moment: Vector3<f64>,
    /// About the origin, kg·m².
    pub inertia: Matrix3<f64>,
}

/// How the joint that carries a link sits elsewhere.
#[derive(Debug, Clone, PartialEq)]
pub struct JointChange {
    /// The link it carries.
    pub link: String,
    /// By how much it is shifted, m, in the axes of the last link before it that moves.
    pub before: Vector3<f64>,
    /// What comes after it, in its own axes: a turn of its axis, of its zero.
    pub after: Isometry3<f64>,
}

/// Other numbers of a robot.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Revision {
    /// Of its links.
    pub links: Vec<LinkChange>,
    /// Of its joints.
    pub joints: Vec<JointChange>,
}

impl Revision {
    /// Returns the text of a URDF with these numbers; `why` is written at its head.
    ///
    /// # Errors
    ///
    /// [`Error::Urdf`] for text that is no URDF, a link that would weigh nothing or less, or a text in which a number cannot
    /// be changed without changing something else.
    pub fn written(&self, text: &str, why: &str) -> Result<String, Error> {
        let urdf = urdf_rs::read_from_string(text)
            .map_err(|error| Error::Urdf { what: UrdfFault::Format(error.to_string()) })?;
        // What a comment holds is no element.
        let bare = masked(text);
        let mut meant = urdf.clone();
        let mut edits: Vec<(Range<usize>, String)> = Vec::new();
        for change in &self.links {
            let known = meant.links.iter_mut().find(|link| link.name == change.link);
            let known = known.ok_or_else(|| missing("link", &change.link))?;
            known.inertial = inertial(&known.inertial, change)?;
            let mut links = elements(&bare, "link").into_iter();
            let link = links.find(|at| attribute(&bare[at.clone()], "name") == Some(&change.link));
            let link = link.ok_or_else(|| missing("link", &change.link))?;
            edits.push(put(&bare, link, "inertial", inertial_text(&known.inertial))?);
        }
        for change in &self.joints {
            let known = meant.joints.iter_mut().find(|joint| joint.child.link == change.link);
            let known = known.ok_or_else(|| missing("joint of link", &change.link))?;
            let turn = still_between(&urdf, &known.parent.link);
            let shift = Translation3::from(turn.inverse() * change.before);
            known.origin = pose(&(shift * super::urdf::pose_of(&known.origin) * change.after));
            // A joint is named in transmissions, too, where it carries nothing.
            let joint = elements(&bare, "joint").into_iter().find(|at| {
                attribute(&bare[at.clone()], "name") == Some(&known.name)
                    && !elements(&bare[at.clone()], "child").is_empty()
            });
            let joint = joint.ok_or_else(|| missing("joint", &known.name))?;
            edits.push(put(&bare, joint, "origin", origin_text(&known.origin))?);
        }
        edits.sort_by_key(|(at, _)| std::cmp::Reverse(at.start));
        let mut written = text.to_owned();
        for (at, new) in edits {
            written.replace_range(at, &new);
        }
        // All edits are behind it. Two hyphens would end a comment.
        let head = bare.find("<robot").unwrap_or(0);
        written.insert_str(head, &format!("<!-- {} -->\n", why.replace("--", "- ")));
        let read = urdf_rs::read_from_string(&written);
        if read.is_ok_and(|read| same(&read, &meant)) {
            return Ok(written);
        }
        Err(Error::Urdf { what: UrdfFault::Entangled })
    }
}

/// Returns whether two robots have the same masses and origins, link by link and joint by joint.
fn same(a: &urdf_rs::Robot, b: &urdf_rs::Robot) -> bool {
    let links = a.links.iter().zip(&b.links).all(|(a, b)| {
        let (i, j) = (&a.inertial, &b.inertial);
        let numbers = |i: &urdf_rs::Inertial| {
            let m = &i.inertia;
            [i.mass.value, m.ixx, m.ixy, m.ixz, m.iyy, m.iyz, m.izz]
        };
        let equal = numbers(i).iter().zip(numbers(j)).all(|(a, b)| near(*a, b));
        a.name == b.name && equal && same_pose(&i.origin, &j.origin)
    });
    let joints = a.joints.iter().zip(&b.joints);
    let joints =
        joints.into_iter().all(|(a, b)| a.name == b.name && same_pose(&a.origin, &b.origin));
    a.links.len() == b.links.len() && a.joints.len() == b.joints.len() && links && joints
}

fn same_pose(a: &urdf_rs::Pose, b: &urdf_rs::Pose) -> bool {
    let pairs = a.xyz.0.iter().zip(&b.xyz.0).chain(a.rpy.0.iter().zip(&b.rpy.0));
    pairs.into_iter().all(|(a, b)| near(*a, *b))
}

/// Whether a number is what it was written as.
fn near(a: f64, b: f64) -> bool {
    (a - b).abs() <= 1e-12 * b.abs().max(1.0)
}

fn missing(what: &str, name: &str) -> Error {
    Error::Urdf { what: UrdfFault::Missing { what: what.to_owned(), name: name.to_owned() } }
}

/// Returns the turn from the last link that moves to a link that is fixed to it.
fn still_between(urdf: &urdf_rs::Robot, link: &str) -> UnitQuaternion<f64> {
    let mut turn = UnitQuaternion::identity();
    let mut here = link;
    // No tree is deeper than it has joints.
    for _ in 0..urdf.joints.len() {
        let Some(joint) = urdf.joints.iter().find(|joint| joint.child.link == here) else { break };
        if joint.joint_type != urdf_rs::JointType::Fixed {
            break;
        }
        turn = super::urdf::pose_of(&joint.origin).rotation * turn;
        here = &joint.parent.link;
    }
    turn
}

/// Returns a link's inertial numbers with a change, in the link's own axes.
fn inertial(old: &urdf_rs::Inertial, change: &LinkChange) -> Result<urdf_rs::Inertial, Error> {
    let i = &old.inertia;
    let own = Inertial {
        mass: old.mass.value,
        com: Vector3::zeros(),
        inertia: Matrix3::new(i.ixx, i.ixy, i.ixz, i.ixy, i.iyy, i.iyz, i.ixz, i.iyz, i.izz),
    };
    let own = own.seen_from(&super::urdf::pose_of(&old.origin));
    let mass = own.mass + change.mass;
    if mass <= 0.0 {
        let what = UrdfFault::WouldWeigh { link: change.link.clone(), mass };
        return Err(Error::Urdf { what });
    }
    // About the origin, where changes add up, and back to the centre.
    let steiner = |mass: f64, com: &Vector3<f64>| {
        mass * (Matrix3::identity() * com.norm_squared() - com * com.transpose())
    };
    let com = (own.mass * own.com + change.moment) / mass;
    let m = own.inertia + steiner(own.mass, &own.com) + change.inertia - steiner(mass, &com);
    Ok(urdf_rs::Inertial {
        origin: pose(&Isometry3::translation(com.x, com.y, com.z)),
        mass: urdf_rs::Mass { value: mass },
        inertia: urdf_rs::Inertia {
            ixx: m.m11,
            ixy: m.m12,
            ixz: m.m13,
            iyy: m.m22,
            iyz: m.m23,
            izz: m.m33,
        },
    })
}

fn pose(origin: &Isometry3<f64>) -> urdf_rs::Pose {
    let (roll, pitch, yaw) = origin.rotation.euler_angles();
    // No minus before a zero.
    let plain = |values: [f64; 3]| urdf_rs::Vec3(values.map(|value| value + 0.0));
    urdf_rs::Pose { xyz: plain(origin.translation.vector.into()), rpy: plain([roll, pitch, yaw]) }
}

fn origin_text(origin: &urdf_rs::Pose) -> String {
    let ([x, y, z], [roll, pitch, yaw]) = (origin.xyz.0, origin.rpy.0);
    format!("<origin xyz=\"{x} {y} {z}\" rpy=\"{roll} {pitch} {yaw}\"/>")
}

fn inertial_text(of: &urdf_rs::Inertial) -> String {
    let (origin, mass, i) = (origin_text(&of.origin), of.mass.value, &of.inertia);
    format!(
        "<inertial>{origin}<mass value=\"{mass}\"/><inertia ixx=\"{}\" ixy=\"{}\" ixz=\"{}\" iyy=\"{}\" iyz=\"{}\" \
         izz=\"{}\"/></inertial>",
        i.ixx, i.ixy, i.ixz, i.iyy, i.iyz, i.izz
    )
}

/// Returns the text with every comment blank, byte by byte.
fn masked(text: &str) -> String {
    let mut bare = String::with_capacity(text.len());
    let mut rest = text;
    while let Some((before, comment)) = rest.split_once("<!--") {
        let (_, after) = comment.split_once("-->").unwrap_or((comment, ""));
        bare.push_str(before);
        bare.extend(std::iter::repeat_n(' ', rest.len() - before.len() - after.len()));
        rest = after;
    }
    bare.push_str(rest);
    bare
}

/// Returns where the elements of a name are, tags included.
fn elements(bare: &str, name: &str) -> Vec<Range<usize>> {
    let (open, close) = (format!("<{name}"), format!("</{name}"));
    let mut found = Vec::new();
    let mut from = 0;
    while let Some(at) = bare[from..].find(&open).map(|at| from + at) {
        from = at + open.len();
        let is_it = bare[from..].starts_with(|c: char| c.is_whitespace() || c == '>' || c == '/');
        let Some(end) = bare[from..].find('>').map(|end| from + end).filter(|_| is_it) else {
            continue;
        };
        let end = if bare[..end].ends_with('/') {
            end + 1
        } else {
            let Some(last) = bare[end..].find(&close).map(|last| end + last) else { continue };
            let Some(end) = bare[last..].find('>').map(|end| last + end) else { continue };
            end + 1
        };
        found.push(at..end);
        from = end;
    }
    found
}

/// Returns an attribute of an element's first tag.
fn attribute<'a>(element: &'a str, name: &str) -> Option<&'a str> {
    let tag = &element[..element.find('>')?];
    let mut rest = tag;
    loop {
        let (before, after) = rest.split_once(name)?;
        let is_whole = before.ends_with(char::is_whitespace);
        let value = after.trim_start().strip_prefix('=').map(str::trim_start);
        if let (true, Some(value)) = (is_whole, value) {
            let quote = value.chars().next().filter(|c| matches!(c, '"' | '\''))?;
            return value[1..].split_once(quote).map(|(value, _)| value);
        }
        rest = after;
    }
}

/// Returns the edit that puts a child element in the place of the one of its name, or beside the others if there is none.
fn put(
    bare: &str,
    parent: Range<usize>,
    child: &str,
    new: String,
) -> Result<(Range<usize>, String), Error> {
    let own = &bare[parent.clone()];
    if let Some(old) = elements(own, child).into_iter().next() {
        return Ok((parent.start + old.start..parent.start + old.end, new));
    }
    // After the first tag; an element without others gets room for one.
    let tag = own.find('>').ok_or_else(|| missing("end of", child))?;
    if own[..tag].ends_with('/') {
        let name: String = own[1..].chars().take_while(|c| c.is_alphanumeric()).collect();
        return Ok((parent.start + tag - 1..parent.end, format!(">{new}</{name}>")));
    }
    let at = parent.start + tag + 1;
    Ok((at..at, new))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motion::Robot;

    const ARM: &str = "<?xml version=\"1.0\"?>\n<!-- <link name=\"a\"/> -->\n<robot name=\"r\">\n  <link name=\"base\"/>\n  \
        <link name='a'>\n    <inertial>\n      <origin xyz=\"0 0 0.1\"/><mass value=\"2\"/>\n      <inertia ixx=\"0.01\" ixy=\"0\" \
        ixz=\"0\" iyy=\"0.01\" iyz=\"0\" izz=\"0.01\"/>\n    </inertial>\n  </link>\n  <link name=\"b\"/>\n  \
        <joint name=\"ja\" type=\"revolute\"><parent link=\"base\"/><child link=\"a\"/><axis xyz=\"0 0 1\"/>\
        <limit lower=\"-1\" upper=\"1\" effort=\"1\" velocity=\"1\"/></joint>\n  \
        <joint name=\"jb\" type=\"fixed\"><origin xyz=\"0 0 1\" rpy=\"0 0 0\"/><parent link=\"a\"/><child link=\"b\"/></joint>\n\
        </robot>\n";

    #[test]
    fn what_is_changed_is_read_again_and_all_else_stays() {
        let change = LinkChange {
            link: "a".into(),
            mass: 1.0,
            moment: Vector3::new(0.3, 0.0, 0.1),
            inertia: Matrix3::identity() * 0.05,
        };
        let joint = JointChange {
            link: "a".into(),
            before: Vector3::new(0.0, 0.0, 0.25),
            after: Isometry3::rotation(Vector3::z() * 0.5),
        };
        let revision = Revision { links: vec![change], joints: vec![joint] };
        let text = revision.written(ARM, "found -- by hand").unwrap();
        assert!(text.contains("<!-- found -  by hand -->\n<robot"), "{text}");
        assert!(
            text.contains("<!-- <link name=\"a\"/> -->") && text.contains("<link name=\"b\"/>")
        );
        let [old, new] = [ARM, &text].map(|text| Robot::from_urdf(text, Some("b")).unwrap());
        let inertial = new.links()[1].inertial.unwrap();
        assert!((inertial.mass - 3.0).abs() < 1e-12);
        assert!((inertial.com - Vector3::new(0.1, 0.0, 0.1)).norm() < 1e-12);
        // About the origin: 0.01 and 2 kg at 0.1 m, and 0.05 more; about the centre 3 kg less.
        assert!((inertial.inertia[(1, 1)] - (0.01 + 0.02 + 0.05 - 3.0 * 0.02)).abs() < 1e-12);
        let tip = |robot: &Robot, q: f64| *robot.forward(&[q]).unwrap().isometry();
        let apart = tip(&old, 0.5).translation.vector + Vector3::z() * 0.25;
        assert!((tip(&new, 0.0).translation.vector - apart).norm() < 1e-12);
        assert!(tip(&new, 0.0).rotation.angle_to(&tip(&old, 0.5).rotation) < 1e-12);
    }

    #[test]
    fn a_link_that_would_weigh_nothing_is_refused() {
        let change = LinkChange {
            link: "a".into(),
            mass: -2.5,
            moment: Vector3::zeros(),
            inertia: Matrix3::zeros(),
        };
        let revision = Revision { links: vec![change], joints: Vec::new() };
        let refused = revision.written(ARM, "x").unwrap_err().to_string();
        assert!(refused.contains("link a would weigh -0.500 kg"), "{refused}");
    }
}
