//! `mesh "file.stl"`: the file beside the scene's, what it may be, and what is told when it is none.

use std::io::ErrorKind;
use std::path::Path;
use std::sync::Arc;

use super::error::Mistake;
use super::read::Reader;
use crate::files;
use crate::language::ast::{ExprKind, SceneThing};
use crate::world::Shape;
use crate::world::mesh::read::{self, LARGEST, Unread};
use crate::world::mesh::{Fault, Mesh};

/// Sides of things that stand on tables, m: what a unit makes of a file's numbers should lie between. Chosen: a die and a
/// crate.
const USUAL: [f64; 2] = [0.01, 0.5];
/// Units that files are written in, m, with how they are written here.
const UNITS: [(f64, &str); 4] = [(1e-3, "1 mm"), (1e-2, "1 cm"), (1.0, "1 m"), (0.0254, "25.4 mm")];

/// Why a file is no thing's shape.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum NoMesh {
    /// There is no such file in a folder.
    Missing(String),
    /// The system does not let it be read.
    Refused(String),
    /// Its bytes are no mesh.
    File(Unread),
    /// Its triangles are no solid; and the unit that was taken for its numbers, m.
    Solid(Fault, f64),
}

impl NoMesh {
    /// What would help.
    pub(super) fn help(&self) -> String {
        match self {
            Self::Missing(folder) => super::error::mesh_is_looked_for(folder),
            Self::Refused(_) => super::error::mesh_permissions(),
            Self::File(why) => super::error::mesh_of_bytes(why),
            Self::Solid(fault @ (Fault::Large(side) | Fault::Small(side)), unit) => {
                let fits = UNITS
                    .iter()
                    .find(|(one, _)| (USUAL[0]..=USUAL[1]).contains(&(side / unit * one)));
                super::error::mesh_of_size(fault, fits.map(|(_, written)| *written))
            }
            Self::Solid(fault, _) => super::error::mesh_of_triangles(fault),
        }
    }
}

impl Reader<'_> {
    /// Reads the shape of a thing from its file; one number of it is `unit` m.
    pub(super) fn mesh(&mut self, thing: &SceneThing, unit: Option<f64>) -> Option<Shape> {
        let named = thing.shape.args.first().and_then(|arg| match &arg.values.first()?.kind {
            ExprKind::Text(file) => Some((file.as_str(), arg.span)),
            _ => None,
        });
        let Some((file, span)) = named else {
            self.tell(thing.shape.span, &Mistake::MeshNoFile);
            return None;
        };
        // As URDF and ROS have it, where nothing is said.
        let unit = unit.unwrap_or(1.0);
        match self.solid(file, unit) {
            Ok(mesh) => Some(Shape::Mesh { mesh: Arc::new(mesh) }),
            Err(why) => {
                self.tell(span, &Mistake::NoMesh { file, why });
                None
            }
        }
    }

    fn solid(&self, file: &str, unit: f64) -> Result<Mesh, NoMesh> {
        read::reader_of(file).map_err(NoMesh::File)?;
        let beside = Path::new(&self.source.name).parent().unwrap_or(Path::new(""));
        let bytes = files::read::bytes(&beside.join(file), LARGEST).map_err(|error| {
            if error.kind() == ErrorKind::NotFound {
                let folder = if beside.as_os_str().is_empty() { Path::new(".") } else { beside };
                NoMesh::Missing(folder.display().to_string())
            } else {
                NoMesh::Refused(error.to_string())
            }
        })?;
        let one = nalgebra::Vector3::repeat(1.0);
        let triangles = read::triangles(file, &bytes, &one).map_err(NoMesh::File)?;
        Mesh::new(file, &triangles, unit).map_err(|fault| NoMesh::Solid(fault, unit))
    }
}
