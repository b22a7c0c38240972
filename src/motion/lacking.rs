//! Which element of a URDF lacks what its reader says is missing, and where it stands.
//!
//! The reader names the field alone. Only what it reads is looked at: robot, links, joints and materials, not what simulators add.
//!
//! Source: the URDF specification, <http://wiki.ros.org/urdf/XML>.

use super::bounds::{name_of, tags};
use super::fault::{Lacking, UrdfFault};

/// What has to be there, an attribute or an element inside, and of which elements.
const NEEDED: &[(&str, &[&str])] = &[
    ("name", &["robot", "link", "joint", "material"]),
    ("type", &["joint"]),
    ("parent", &["joint"]),
    ("child", &["joint"]),
    ("link", &["parent", "child"]),
    ("joint", &["mimic"]),
    ("velocity", &["limit"]),
    ("xyz", &["axis"]),
    ("k_velocity", &["safety_controller"]),
    ("geometry", &["visual", "collision"]),
    ("filename", &["mesh", "texture"]),
    ("size", &["box"]),
    ("radius", &["cylinder", "capsule", "sphere"]),
    ("length", &["cylinder", "capsule"]),
    ("rgba", &["color"]),
    ("mass", &["inertial"]),
    ("inertia", &["inertial"]),
    ("value", &["mass"]),
    ("ixx", &["inertia"]),
    ("ixy", &["inertia"]),
    ("ixz", &["inertia"]),
    ("iyy", &["inertia"]),
    ("iyz", &["inertia"]),
    ("izz", &["inertia"]),
];
/// The elements that have names, of which all others are part.
const PARTS: &[&str] = &["robot", "link", "joint", "material"];

/// An element whose end is not read yet.
struct Open<'t> {
    at: usize,
    tag: &'t str,
    /// Whether what is looked for was in it.
    has: bool,
}

/// Returns the first element that lacks a field it needs, if one does.
pub(super) fn lacking(text: &str, field: &str) -> Option<UrdfFault> {
    let (_, elements) = NEEDED.iter().find(|(name, _)| *name == field)?;
    let mut open: Vec<Open<'_>> = Vec::new();
    for (at, tag) in tags(text) {
        let ended = if tag.starts_with('/') {
            open.pop()?
        } else {
            if let Some(around) = open.last_mut() {
                around.has |= name_of(tag) == field;
            }
            let begun = Open { at, tag, has: attribute(tag, field).is_some() };
            if !tag.ends_with('/') {
                open.push(begun);
                continue;
            }
            begun
        };
        let element = name_of(ended.tag);
        let part = match open.len() {
            0 | 1 => ended.tag,
            _ => open[1].tag,
        };
        if !ended.has && elements.contains(&element) && PARTS.contains(&name_of(part)) {
            return Some(UrdfFault::Lacks(Box::new(Lacking {
                element: element.to_owned(),
                field: field.to_owned(),
                part: name_of(part).to_owned(),
                name: attribute(part, "name").unwrap_or_default().to_owned(),
                line: text[..ended.at].matches('\n').count() + 1,
            })));
        }
    }
    None
}

/// Returns the value of an attribute of a tag.
fn attribute<'t>(tag: &'t str, name: &str) -> Option<&'t str> {
    let mut rest = tag.trim_start_matches(|c: char| !c.is_whitespace());
    loop {
        let (key, after) = rest.split_once('=')?;
        let after = after.trim_start();
        let quote = after.chars().next().filter(|c| matches!(c, '"' | '\''))?;
        let (value, next) = after[1..].split_once(quote)?;
        if key.trim() == name {
            return Some(value);
        }
        rest = next;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = r#"<?xml version="1.0"?>
<robot name = 'r'>
  <!-- <mesh/> --><gazebo><collision/><mesh/></gazebo>
  <link name="a"><visual name="filename='x'"><geometry><mesh scale="1 1 1" filename = "a.stl"/></geometry>
    <material name="m"><texture />
    </material></visual></link>
  <joint name="j" type="fixed"><parent link="a"/></joint>
</robot>"#;

    #[test]
    fn the_element_that_lacks_something_is_named_with_its_line() {
        let said = |field: &str| lacking(TEXT, field).map(|fault| fault.to_string());
        assert_eq!(said("filename").unwrap(), "line 5: <texture> of link a has no filename");
        assert_eq!(said("child").unwrap(), "line 7: <joint> j has no child");
        for field in ["geometry", "name", "type", "link", "velocity", "nonsense"] {
            assert_eq!(said(field), None, "{field}");
        }
        assert!(lacking("<robot><link/></robot>", "name").unwrap().to_string().contains("<link>"));
    }

    #[test]
    fn what_is_no_xml_lacks_nothing() {
        for text in ["", "<", "</a></a>", "<a b", "<mesh =>", "<mesh a=b/>", "<é é='é' mesh/>"] {
            assert_eq!(lacking(text, "filename"), None, "{text}");
        }
    }
}
