//! Which element of a URDF lacks what its reader says is missing or has in it what it cannot have, and where it stands.
//!
//! The reader names the field alone, or what it found. Only what it reads is looked at: robot, links, joints and materials, not what simulators add.
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

/// What a geometry has to be one of, as messages call it.
const SHAPE: &str = "single shape";
/// So much of a text that is out of place is shown, letters.
const SHOWN: usize = 40;

/// An element whose end is not read yet.
struct Open<'t> {
    at: usize,
    tag: &'t str,
    /// The names of the elements directly in it.
    inside: Vec<&'t str>,
}

impl Open<'_> {
    /// Returns whether it has an attribute of a name, or an element in it.
    fn has(&self, field: &str) -> bool {
        attribute(self.tag, field).is_some() || self.inside.contains(&field)
    }
}

/// Returns the first element that lacks a field it needs, if one does.
pub(super) fn lacking(text: &str, field: &str) -> Option<UrdfFault> {
    let (_, elements) = NEEDED.iter().find(|(name, _)| *name == field)?;
    first(text, field, |element| !element.has(field) && elements.contains(&name_of(element.tag)))
}

/// Says in the terms of the format what its reader says in those of a reader: an element that is empty or has too much in it,
/// or a text.
pub(super) fn out_of_place(text: &str, said: &str) -> Option<UrdfFault> {
    let (_, found) = said.split_once("Expected token ")?.1.split_once(", found ")?;
    let is_odd =
        |element: &Open<'_>| name_of(element.tag) == "geometry" && element.inside.len() != 1;
    first(text, SHAPE, is_odd).or_else(|| {
        let (kind, rest) = found.split_once('(')?;
        let name = rest.split([',', ')']).next().unwrap_or_default();
        let name: String = name.chars().take(SHOWN).collect();
        let found = match kind {
            "StartElement" => format!("<{name}>"),
            "EndElement" => format!("</{name}>"),
            _ => format!("\"{name}\""),
        };
        Some(UrdfFault::OutOfPlace { found })
    })
}

/// Returns the first element for which `is_odd` holds at its end, as one that lacks a field.
fn first(text: &str, field: &str, is_odd: impl Fn(&Open<'_>) -> bool) -> Option<UrdfFault> {
    let mut open: Vec<Open<'_>> = Vec::new();
    for (at, tag) in tags(text) {
        let ended = if tag.starts_with('/') {
            open.pop()?
        } else {
            if let Some(around) = open.last_mut() {
                around.inside.push(name_of(tag));
            }
            let begun = Open { at, tag, inside: Vec::new() };
            if !tag.ends_with('/') {
                open.push(begun);
                continue;
            }
            begun
        };
        let part = match open.len() {
            0 | 1 => ended.tag,
            _ => open[1].tag,
        };
        if is_odd(&ended) && PARTS.contains(&name_of(part)) {
            return Some(UrdfFault::Lacks(Box::new(Lacking {
                element: name_of(ended.tag).to_owned(),
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

    /// `Expected token &XmlEvent::Characters(ref name) | &XmlEvent::StartElement { .. }, found EndElement(geometry)`.
    #[test]
    fn an_empty_geometry_and_what_is_out_of_place_are_told_in_words() {
        let said = |text: &str, found: &str| {
            let token = format!("Expected token XmlEvent::Characters(ref s), found {found}");
            out_of_place(text, &token).map(|fault| fault.to_string())
        };
        let link = |inside: &str| {
            format!("<robot>\n<link name='a'><collision>{inside}</collision></link></robot>")
        };
        for inside in ["<geometry></geometry>", "<geometry/>", "<geometry><box/><box/></geometry>"]
        {
            let told = said(&link(inside), "EndElement(geometry)").unwrap();
            assert_eq!(told, "line 2: <geometry> of link a has no single shape", "{inside}");
        }
        let told = |found: &str| said(&link("<geometry><box/></geometry>"), found).unwrap();
        assert_eq!(told("EndElement(mass)"), "</mass> stands where it cannot be read");
        assert_eq!(told("StartElement(b, {\"\": \"\"}, [])"), "<b> stands where it cannot be read");
        assert_eq!(told("Characters(box)"), "\"box\" stands where it cannot be read");
        assert_eq!(out_of_place(TEXT, "missing field `xyz`"), None);
    }

    #[test]
    fn what_is_no_xml_lacks_nothing() {
        for text in ["", "<", "</a></a>", "<a b", "<mesh =>", "<mesh a=b/>", "<é é='é' mesh/>"] {
            assert_eq!(lacking(text, "filename"), None, "{text}");
        }
    }
}
