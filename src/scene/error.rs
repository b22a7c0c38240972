//! What can be wrong with a scene: the mistakes with their numbers, and how each is told.
//!
//! The message is what a mistake displays as; its code, its label under the text and what would help stand
//! beside it. Where it is wrong is for the reader to say.

use super::mesh::NoMesh;
use crate::language::nearest;
use crate::units::{Dimension, Quantity, known_units};
use crate::world::mesh::{self, read::Unread};
use crate::world::mug;
use crate::world::profile::Fault;

/// Properties a thing may have.
const PROPERTIES: &[&str] =
    &["wall", "holds", "filled", "mass", "unit", "looks", "colour", "case", "travel", "handle"];

/// Shapes a thing may have.
const SHAPES: [&str; 8] = ["box", "cuboid", "cylinder", "cone", "ball", "lathe", "mug", "mesh"];

/// One thing that is wrong with a scene. Lengths in m, volumes in m³.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub(super) enum Mistake<'a> {
    #[error("there are two things called `{name}`")]
    TwoThings { name: &'a str },
    #[error("the scene `{scene}` has no table")]
    NoTable { scene: &'a str },
    #[error("this mark does not lie on the table")]
    MarkOutside { corners: [[f64; 2]; 4] },
    #[error("the scene `{scene}` has no camera")]
    NoCamera { scene: &'a str },
    #[error("a scene has one camera")]
    TwoCameras,
    #[error("a focal length of {focal} px is impossible")]
    FocalLength { focal: f64 },
    #[error("`{file}` is not read as a calibration: {why}")]
    NoCalibration { file: &'a str, why: String },
    #[error("`{file}` does not say how large its camera's pictures are")]
    NoPictureSize { file: &'a str },
    #[error("the camera `{camera}` cannot see the table from there")]
    BlindCamera { camera: &'a str },
    #[error("a scene has one robot")]
    TwoRobots,
    #[error("a scene has one place for a person")]
    TwoPeople,
    #[error("a person takes things above the table")]
    PersonBelow,
    #[error("the scene `{scene}` has no robot")]
    NoRobot { scene: &'a str },
    #[error("a table is a box")]
    TableNoBox,
    #[error("the table's centre needs x and y")]
    TableCentre,
    #[error("heights are measured from the table's top, so it has none itself")]
    TableHeight,
    #[error("{} is a length, and this is {}", of.words(), is.words())]
    NoLength { of: Side<'a>, is: Dimension, text: &'a str },
    #[error("{} cannot be {quantity}", of.words())]
    Length { of: Side<'a>, quantity: Quantity, most: f64 },
    #[error("{quantity} is outside the laboratory")]
    FarCoordinate { quantity: Quantity },
    #[error("a coordinate is a length, and `{text}` {}", if is.is_none() {
        "has no unit".to_owned()
    } else {
        format!("is {}", is.words())
    })]
    CoordinateUnit { text: &'a str, is: Dimension },
    #[error("the walls of `{thing}` leave no room inside")]
    ThickWalls { thing: &'a str },
    #[error("`{thing}` cannot hold {}: inside it measures {}",
        Quantity::cubic_metres(*holds), Quantity::cubic_metres(*inside))]
    HoldsTooMuch { thing: &'a str, holds: f64, inside: f64 },
    #[error("`{thing}` is filled with {} but holds {}",
        Quantity::cubic_metres(*filled), Quantity::cubic_metres(*holds))]
    Overfilled { thing: &'a str, filled: f64, holds: f64 },
    #[error("there is no shape `{name}`")]
    UnknownShape { name: &'a str },
    #[error("a {shape} takes {}", slots.join(", "))]
    ShapeTakes { shape: &'a str, slots: &'static [&'static str] },
    #[error("a {shape} has no `{name}`")]
    NoSide { shape: &'a str, name: &'a str, near: &'static str },
    #[error("a lathe takes a radius and a height for each point, by turns")]
    LathePairs,
    #[error("{0}")]
    NoProfile(Fault),
    #[error("the vessel `{thing}` has a neck, and liquid in a neck is not simulated")]
    Neck { thing: &'a str },
    #[error("{0}")]
    NoMug(mug::Fault),
    #[error("a mesh is a file")]
    MeshNoFile,
    #[error("`{file}` {}", mesh_fault(why))]
    NoMesh { file: &'a str, why: NoMesh },
    #[error("`{thing}` is a mesh, and no liquid is simulated in a mesh")]
    MeshHolds { thing: &'a str },
    #[error("`{thing}` is no mesh: its sizes have units of their own")]
    UnitOfNone { thing: &'a str },
    #[error("`{thing}` is a drawer, and nothing says what it slides in and how far")]
    NoCase { thing: &'a str },
    #[error("there is no thing `{case}` to slide in")]
    UnknownCase { case: &'a str },
    #[error("a drawer and its case are boxes")]
    DrawerNoBox,
    #[error("`{thing}` does not go into `{case}`")]
    TightCase { thing: &'a str, case: &'a str },
    #[error("drawn by {}, `{thing}` would fall out: it is {} deep",
        Quantity::metres(*travel), Quantity::metres(*depth))]
    LongTravel { thing: &'a str, travel: f64, depth: f64 },
    #[error("a handle of {} leaves no room for fingers", Quantity::metres(*bar))]
    ShortHandle { bar: f64 },
    #[error("this is not a colour")]
    NoColour,
    #[error("a thing has no `{name}`")]
    UnknownProperty { name: &'a str },
    #[error("`{name}` is {}, and this is {}", wanted.words(), is.words())]
    WrongUnit { name: &'a str, wanted: Dimension, is: Dimension, such: &'static str },
    #[error("`{name}` cannot be {quantity}")]
    NotPositive { name: &'a str, quantity: Quantity, such: &'static str },
    #[error("`{name}` takes one quantity")]
    NoQuantity { name: &'a str, such: &'static str },
    #[error("`{name}` takes a text in quotes")]
    NoText { name: &'a str },
}

/// A length that a scene gives.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Side<'a> {
    /// Of a dot on the table.
    MarkRadius,
    /// Of a thing's shape.
    Of(&'a str),
}

impl Side<'_> {
    fn words(self) -> String {
        match self {
            Self::MarkRadius => "the radius of a mark".into(),
            Self::Of(thing) => format!("a side of `{thing}`"),
        }
    }
}

impl Mistake<'_> {
    /// Its code, and what stands under the place in the text.
    pub(super) fn code_and_label(&self) -> (&'static str, &'static str) {
        match self {
            Self::TwoThings { .. } | Self::TwoCameras | Self::TwoRobots | Self::TwoPeople => {
                ("task::duplicate", "the second one")
            }
            Self::NoTable { .. } => ("task::missing", "things need something to stand on"),
            Self::NoCamera { .. } => ("task::missing", "nothing could be seen"),
            Self::NoRobot { .. } => ("task::missing", "nothing could be moved"),
            Self::MarkOutside { .. } => ("task::outside", "outside"),
            Self::PersonBelow => ("task::outside", "at the height of the table, or below"),
            Self::BlindCamera { .. } => {
                ("task::outside", "at the height of the table, or where it looks")
            }
            Self::NoCalibration { .. } => ("scene::calibration", "named here"),
            Self::NoPictureSize { .. } => ("scene::calibration", "no size in it"),
            Self::FocalLength { .. } | Self::NotPositive { .. } => ("task::size", "not above 0"),
            Self::ThickWalls { .. } => ("task::size", "walls as thick as the vessel"),
            Self::HoldsTooMuch { .. } => ("task::size", "holds more than fits"),
            Self::Overfilled { .. } => ("task::size", "fuller than full"),
            Self::Length { .. } => ("task::size", "not a size it can have"),
            Self::NoLength { .. } => ("task::unit", "not a length"),
            Self::FarCoordinate { .. } | Self::CoordinateUnit { .. } => {
                ("task::unit", "expected a length")
            }
            Self::WrongUnit { .. } => ("task::unit", "wrong unit"),
            Self::TableNoBox => ("task::type", "not a box"),
            Self::NoQuantity { .. } => ("task::type", "expected one"),
            Self::NoText { .. } => ("task::type", "expected a text"),
            Self::TableCentre => ("task::point", "too few"),
            Self::TableHeight => ("task::point", "expected x and y"),
            Self::UnknownShape { .. } => ("task::unknown_name", "not a shape"),
            Self::UnknownProperty { .. } | Self::NoSide { .. } => {
                ("task::unknown_name", "not known")
            }
            Self::ShapeTakes { .. } | Self::LathePairs => ("task::argument", "not what it takes"),
            Self::NoProfile(_) => ("task::size", "not a profile"),
            Self::NoMug(_) => ("task::size", "not a mug"),
            Self::Neck { .. } => ("task::size", "narrower above than a straight side would be"),
            Self::NoCase { .. } => ("task::missing", "a drawer slides in a case"),
            Self::UnknownCase { .. } => ("task::unknown_name", "not a thing of this scene"),
            Self::DrawerNoBox => ("task::type", "not a box in a box"),
            Self::TightCase { .. } => ("task::size", "too large for it"),
            Self::LongTravel { .. } => ("task::size", "drawn too far"),
            Self::ShortHandle { .. } => ("task::size", "too short"),
            Self::NoColour => ("task::colour", "expected red, green and blue"),
            Self::MeshNoFile => ("task::argument", "expected a file in quotes"),
            Self::NoMesh { .. } => ("scene::mesh", "named here"),
            Self::MeshHolds { .. } => ("task::type", "holds nothing"),
            Self::UnitOfNone { .. } => ("task::argument", "not needed"),
        }
    }

    /// What would help.
    pub(super) fn help(&self) -> String {
        let said = match self {
            Self::TwoThings { .. } => "give each its own name, such as `cup` and `cup2`",
            Self::NoTable { .. } => {
                "add `table: Surface = box(120 cm, 80 cm, 2 cm) at (0.5 m, 0 m)`"
            }
            Self::NoCamera { .. } => {
                "add `camera overhead { image 1280 x 720  focal ~ 900 px  at (…) looking (…) }`"
            }
            Self::TwoCameras => "keep the camera that looks at the table",
            Self::FocalLength { .. } => "a usual one is close to the width of the picture",
            Self::NoCalibration { .. } => {
                "`trueup camera calibrate photos/*.jpg --board … --write FILE` writes one; the file is looked for \
                 beside the scene's"
            }
            Self::NoPictureSize { .. } => "add `\"image_px\": [1280, 720]` to the file",
            Self::BlindCamera { .. } => {
                "the table top is at z = 0; the camera stands above it and looks at it"
            }
            Self::TwoRobots | Self::TwoPeople => "remove one of them",
            Self::PersonBelow => "write `person at (0.6 m, 0 m, 0.25 m)`",
            Self::NoRobot { .. } => "add `robot gen3_2f85 at (0 m, 0 m, 0 m)`",
            Self::TableNoBox => "write `box(120 cm, 80 cm, 2 cm)`: along x, along y, thickness",
            Self::TableCentre => "write `at (0.5 m, 0 m)`",
            Self::TableHeight => {
                "write `at (0.5 m, 0 m)`; where the arm's foot stands on another height, say that: `robot gen3_2f85 at \
                 (0 m, 0 m, 0.20 m)` is 20 cm above the table's top"
            }
            Self::FarCoordinate { .. } => "at most 10 m",
            Self::ThickWalls { .. } => "give the thickness of one wall, such as `wall 3 mm`",
            Self::HoldsTooMuch { .. } => "correct `holds`, the outside, or `wall`",
            Self::Overfilled { .. } => "correct `filled` or `holds`",
            Self::LathePairs | Self::NoProfile(_) => {
                "write `lathe(30 mm, 0 mm, 40 mm, 60 mm, 42 mm, 95 mm)`: radius and height, from the foot up"
            }
            Self::Neck { .. } => {
                "make it a thing without `wall`, or give it sides that do not bend inwards"
            }
            Self::ShapeTakes { shape: "cone", .. } => {
                "write `cone(bottom 30 mm, top 40 mm, height 95 mm)`: two radii and a height"
            }
            Self::ShapeTakes { shape: "mug", .. } | Self::NoMug(_) => {
                "write `mug(radius 38 mm, height 95 mm, handle 30 mm, thick 10 mm)`: the handle by how far it stands out \
                 from the wall and how thick it is"
            }
            Self::ShapeTakes { shape: "ball", .. } => "write `ball(radius 35 mm)`",
            Self::ShapeTakes { slots, .. } if slots.len() == 3 => {
                "write three sides, such as `cuboid(65 mm, 65 mm, 140 mm)`"
            }
            Self::ShapeTakes { .. } => "write `cylinder(radius 40 mm, height 95 mm)`",
            Self::MeshNoFile => "write `mesh \"bracket.stl\"`, the file beside the scene's",
            Self::MeshHolds { .. } => {
                "declare it as `Graspable` without `wall`, `holds` and `filled`, or give a vessel the shape `cylinder`, \
                 `cone`, `lathe` or `mug`"
            }
            Self::UnitOfNone { .. } => "remove `unit`; it says what one number in a mesh's file is",
            Self::NoCase { .. } => "add `case \"chest\"  travel 12 cm`, with another thing's name",
            Self::UnknownCase { .. } => "declare the case as a thing of its own, before or after",
            Self::DrawerNoBox => "write `cuboid(…)` for both; the front of the case is its +x side",
            Self::TightCase { .. } => {
                "leave 3 mm on each side and above and below, and make it no deeper than the case"
            }
            Self::LongTravel { .. } => "let some centimetres stay in the case",
            Self::ShortHandle { .. } => "pads are 22 mm high; write `handle 50 mm`",
            Self::NoColour => "write it as `\"#2050c0\"`, or name it in `looks`",
            other => return other.help_with_names(),
        };
        said.to_owned()
    }

    /// What would help where names or numbers of the scene are part of it.
    fn help_with_names(&self) -> String {
        match self {
            Self::MarkOutside { corners } => format!(
                "the table reaches from ({:.2} m, {:.2} m) to ({:.2} m, {:.2} m)",
                corners[0][0], corners[0][1], corners[2][0], corners[2][1]
            ),
            Self::NoLength { is, text, .. } if is.is_none() => {
                format!("write `{text} mm` or `{text} cm`")
            }
            Self::NoLength { .. } => {
                format!("lengths are in mm, cm or m; known units: {}", known_units())
            }
            Self::Length { most, .. } => {
                format!("expected more than 0 and at most {}", Quantity::metres(*most))
            }
            Self::CoordinateUnit { text, is } if is.is_none() => format!("write `{text} m`"),
            Self::CoordinateUnit { .. } => "write it in m".into(),
            Self::UnknownShape { name } => match nearest(name, SHAPES.into_iter()) {
                Some(near) => did_you_mean(near),
                None => {
                    "write `cuboid(6 cm, 6 cm, 14 cm)` or `cylinder(radius 4 cm, height 10 cm)`"
                        .into()
                }
            },
            Self::NoSide { near, .. } => did_you_mean(near),
            Self::UnknownProperty { name } => match nearest(name, PROPERTIES.iter().copied()) {
                Some(near) => did_you_mean(near),
                None => format!("known are: {}", PROPERTIES.join(", ")),
            },
            Self::WrongUnit { wanted, such, .. } => {
                format!("write {}, such as {such}", wanted.words())
            }
            Self::NotPositive { such, .. } | Self::NoQuantity { such, .. } => {
                format!("such as {such}")
            }
            Self::NoText { name } => format!("such as `{name} \"…\"`"),
            Self::NoMesh { why, .. } => why.help(),
            // All others are said without a name.
            _ => String::new(),
        }
    }
}

/// What is wrong with a mesh's file, after its name.
fn mesh_fault(why: &NoMesh) -> String {
    match why {
        NoMesh::Missing(_) => "is not there".into(),
        NoMesh::Refused(why) => format!("cannot be read: {why}"),
        NoMesh::File(why) => format!("is no mesh: {why}"),
        NoMesh::Solid(why, _) => format!("is no solid thing: {why}"),
    }
}

pub(super) fn mesh_is_looked_for(folder: &str) -> String {
    format!(
        "it is looked for in `{folder}`, the folder of the scene's file; correct the name, or copy it there"
    )
}

pub(super) fn mesh_permissions() -> String {
    "check its permissions, and that it is a file of at most 64 MiB".into()
}

pub(super) fn mesh_of_bytes(why: &Unread) -> String {
    match why {
        Unread::Format(_) => {
            "save it as `.stl` or `.obj` in your modeller or with `meshlabserver`".into()
        }
        Unread::Broken => {
            "a number is missing or not finite, or it ends too early: export it again".into()
        }
        Unread::Empty => {
            "an OBJ needs faces (`f 1 2 3`), an STL triangles: export it as a mesh".into()
        }
        Unread::TooLarge(_) => {
            "reduce it in your modeller: some hundreds of triangles are enough".into()
        }
    }
}

pub(super) fn mesh_of_size(fault: &mesh::Fault, fits: Option<&str>) -> String {
    match (fits, fault) {
        (Some(unit), _) => {
            format!("write `unit {unit}` in its braces if that is what one number in the file is")
        }
        (None, mesh::Fault::Large(_)) => {
            "a thing is at most 2 m large: `unit` says what one number in the file is".into()
        }
        (None, _) => {
            "a thing is at least 2 mm large: `unit` says what one number in the file is".into()
        }
    }
}

pub(super) fn mesh_of_triangles(fault: &mesh::Fault) -> String {
    let said = match fault {
        mesh::Fault::TooMany(_) => {
            "reduce it in your modeller (Blender: Decimate; MeshLab: Quadric Edge Collapse); some hundreds are enough"
        }
        mesh::Fault::Open { .. } => {
            "close its holes (Blender: Mesh, Clean Up, Fill Holes; MeshLab: Close Holes); a sheet needs a thickness"
        }
        mesh::Fault::Turned { .. } => {
            "make all faces look outwards (Blender: Mesh, Normals, Recalculate Outside; MeshLab: Re-Orient Faces)"
        }
        _ => "give it a thickness",
    };
    said.into()
}

fn did_you_mean(name: &str) -> String {
    format!("did you mean `{name}`?")
}
