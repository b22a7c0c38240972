//! Meshes that a URDF names: where the file is.
//!
//! In goes the name as the URDF has it (`package://ur_description/meshes/base.stl`), out come the file's bytes. They are
//! read in [`crate::world::mesh::read`]; which solids stand for a mesh is `super::cover`'s to say.

use std::path::{Path, PathBuf};

use super::fault::MeshFault;
use crate::files;
use crate::world::mesh::read::LARGEST;

/// Returns the bytes of a mesh by its name in a URDF, or why there are none.
pub type Source<'a> = dyn Fn(&str) -> Result<Vec<u8>, MeshFault> + 'a;

/// The source of a text that lies in no folder.
///
/// # Errors
///
/// Always [`MeshFault::Missing`].
pub fn nowhere(_: &str) -> Result<Vec<u8>, MeshFault> {
    Err(MeshFault::Missing)
}

/// The source of a robot of which nobody asks what it touches.
///
/// # Errors
///
/// Always [`MeshFault::NotAsked`].
pub fn not_asked(_: &str) -> Result<Vec<u8>, MeshFault> {
    Err(MeshFault::NotAsked)
}

/// Reads a mesh that a URDF in `folder` names.
///
/// # Errors
///
/// [`MeshFault::Missing`] when it is in none of the places where packages lie, [`MeshFault::Unread`] with what the
/// system says.
pub fn beside(folder: &Path, name: &str) -> Result<Vec<u8>, MeshFault> {
    let path = find(folder, name).ok_or(MeshFault::Missing)?;
    files::read::bytes(&path, LARGEST).map_err(|error| MeshFault::Unread(error.to_string()))
}

/// Looks for a mesh: a package is a folder of that name above the URDF or beside one that is, as in a workspace of ROS.
fn find(folder: &Path, name: &str) -> Option<PathBuf> {
    let folder = std::path::absolute(folder).ok()?;
    let is_there = |path: PathBuf| path.is_file().then_some(path);
    let Some(inside) = name.strip_prefix("package://").or_else(|| name.strip_prefix("model://"))
    else {
        let plain = name.strip_prefix("file://").unwrap_or(name);
        return is_there(folder.join(plain));
    };
    let (package, rest) = inside.split_once('/')?;
    folder.ancestors().find_map(|above| {
        let own = above.file_name().is_some_and(|last| last == package);
        let places = [own.then(|| above.join(rest)), Some(above.join(package).join(rest))];
        // A package that was copied without its own folder.
        let bare = Some(above.join(rest)).filter(|_| above == folder);
        places.into_iter().chain([bare]).flatten().find_map(is_there)
    })
}
