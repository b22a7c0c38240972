//! Meshes that a URDF names: where the file is, and its triangles.
//!
//! In goes the name as the URDF has it (`package://ur_description/meshes/base.stl`), out come triangles in m of the
//! mesh's own frame. STL (binary and text) and OBJ are read; a COLLADA file (`.dae`) is not, nor is anything else. Which
//! solids stand for a mesh is `super::cover`'s to say.
//!
//! Source: 3D Systems, "`StereoLithography` Interface Specification", 1988; Wavefront, "Object Files (.obj)", 1992.

use std::path::{Path, PathBuf};

use nalgebra::Vector3;

use super::fault::MeshFault;
use crate::files;

/// Three corners, m.
pub type Triangle = [Vector3<f64>; 3];

/// Returns the bytes of a mesh by its name in a URDF, or why there are none.
pub type Source<'a> = dyn Fn(&str) -> Result<Vec<u8>, MeshFault> + 'a;

/// The largest mesh that is read, bytes: ten times the largest visual mesh of a UR10.
const LARGEST: u64 = 64 << 20;
/// So many triangles are read at most; the collision meshes of makers have some hundreds to some thousands.
const MOST_TRIANGLES: usize = 400_000;
/// Bytes before the triangles of a binary STL, and of each of them.
const STL_HEAD: usize = 84;
const STL_TRIANGLE: usize = 50;

/// The source of a text that lies in no folder.
///
/// # Errors
///
/// Always [`MeshFault::Missing`].
pub fn nowhere(_: &str) -> Result<Vec<u8>, MeshFault> {
    Err(MeshFault::Missing)
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

/// Returns the triangles of a mesh, its corners stretched by `scale` along the axes.
///
/// # Errors
///
/// [`MeshFault::Format`] for a format that is not read, [`MeshFault::Broken`] and [`MeshFault::TooLarge`] for a file
/// that is not what its name says or larger than a robot's part is, [`MeshFault::Empty`] without a triangle.
pub fn triangles(
    name: &str,
    bytes: &[u8],
    scale: &Vector3<f64>,
) -> Result<Vec<Triangle>, MeshFault> {
    let mut found = reader_of(name)?(bytes)?;
    if found.is_empty() {
        return Err(MeshFault::Empty);
    }
    for corner in found.iter_mut().flatten() {
        corner.component_mul_assign(scale);
        if corner.iter().any(|x| !x.is_finite()) {
            return Err(MeshFault::Broken);
        }
    }
    Ok(found)
}

/// What reads a format.
type Reader = fn(&[u8]) -> Result<Vec<Triangle>, MeshFault>;

/// Returns what reads a mesh of this name.
///
/// # Errors
///
/// [`MeshFault::Format`] when nothing does.
pub(super) fn reader_of(name: &str) -> Result<Reader, MeshFault> {
    let ending = Path::new(name).extension().map(|e| e.to_string_lossy().to_lowercase());
    match ending.as_deref() {
        Some("stl") => Ok(stl),
        Some("obj") => Ok(obj),
        other => Err(MeshFault::Format(other.unwrap_or_default().to_owned())),
    }
}

fn stl(bytes: &[u8]) -> Result<Vec<Triangle>, MeshFault> {
    let count = bytes.get(80..STL_HEAD).and_then(|b| Some(u32::from_le_bytes(b.try_into().ok()?)));
    let count = count.map_or(0, |count| count as usize);
    let fits = bytes.len() >= STL_HEAD && (bytes.len() - STL_HEAD) / STL_TRIANGLE == count;
    // A binary file may begin with the word of a text as well; its length tells.
    if !fits && bytes.starts_with(b"solid") {
        return stl_text(bytes);
    }
    if !fits {
        return Err(MeshFault::Broken);
    }
    if count > MOST_TRIANGLES {
        return Err(MeshFault::TooLarge(MOST_TRIANGLES));
    }
    let number = |b: &[u8]| f32::from_le_bytes([b[0], b[1], b[2], b[3]]);
    let corner = |b: &[u8]| {
        Vector3::new(number(&b[..4]), number(&b[4..8]), number(&b[8..12])).map(f64::from)
    };
    // The normal comes first; it is not needed.
    let triangle = |b: &[u8]| [corner(&b[12..24]), corner(&b[24..36]), corner(&b[36..48])];
    Ok(bytes[STL_HEAD..].chunks_exact(STL_TRIANGLE).map(triangle).collect())
}

fn stl_text(bytes: &[u8]) -> Result<Vec<Triangle>, MeshFault> {
    let text = std::str::from_utf8(bytes).map_err(|_| MeshFault::Broken)?;
    let mut corners = Vec::new();
    for line in text.lines() {
        if let Some(numbers) = line.trim_start().strip_prefix("vertex") {
            corners.push(corner_of(numbers)?);
        }
    }
    let (triangles, rest) = corners.as_chunks::<3>();
    if !rest.is_empty() {
        return Err(MeshFault::Broken);
    }
    if triangles.len() > MOST_TRIANGLES {
        return Err(MeshFault::TooLarge(MOST_TRIANGLES));
    }
    Ok(triangles.to_vec())
}

fn obj(bytes: &[u8]) -> Result<Vec<Triangle>, MeshFault> {
    let text = std::str::from_utf8(bytes).map_err(|_| MeshFault::Broken)?;
    let mut corners = Vec::new();
    let mut triangles = Vec::new();
    for line in text.lines() {
        match line.trim().split_once(char::is_whitespace) {
            Some(("v", numbers)) => corners.push(corner_of(numbers)?),
            Some(("f", places)) => {
                let face: Vec<Vector3<f64>> = places
                    .split_whitespace()
                    .map(|place| corner_at(&corners, place))
                    .collect::<Result<_, _>>()?;
                // A face with more corners is a fan of triangles.
                for pair in face.windows(2).skip(1) {
                    triangles.push([face[0], pair[0], pair[1]]);
                }
            }
            _ => {}
        }
        if triangles.len() > MOST_TRIANGLES {
            return Err(MeshFault::TooLarge(MOST_TRIANGLES));
        }
    }
    Ok(triangles)
}

/// Returns the corner that a face names: `7`, `7/1/3`, or from the end `-1`.
fn corner_at(corners: &[Vector3<f64>], place: &str) -> Result<Vector3<f64>, MeshFault> {
    let number = place.split('/').next().and_then(|n| n.parse::<i64>().ok());
    let index = number.and_then(|number| match number {
        1.. => usize::try_from(number - 1).ok(),
        0 => None,
        _ => corners.len().checked_sub(usize::try_from(number.unsigned_abs()).ok()?),
    });
    index.and_then(|index| corners.get(index)).copied().ok_or(MeshFault::Broken)
}

fn corner_of(numbers: &str) -> Result<Vector3<f64>, MeshFault> {
    let mut each = numbers.split_whitespace().map(str::parse::<f64>);
    let mut next = || each.next().and_then(Result::ok).ok_or(MeshFault::Broken);
    Ok(Vector3::new(next()?, next()?, next()?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_obj_has_faces_of_any_number_of_corners_counted_from_either_end() {
        let square =
            b"# a square\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1/1 2/2 3/3 4/4\nf -4 -3 -2\n";
        let found = triangles("a.OBJ", square, &Vector3::new(0.5, 1.0, 1.0)).unwrap();
        assert_eq!(found.len(), 3);
        assert_eq!(found[1][2], Vector3::new(0.0, 1.0, 0.0));
        assert_eq!(found[2][1], Vector3::new(0.5, 0.0, 0.0));
    }

    #[test]
    fn what_is_no_mesh_is_told_apart() {
        let one = Vector3::repeat(1.0);
        let said = |name: &str, bytes: &[u8]| triangles(name, bytes, &one).unwrap_err();
        assert_eq!(said("a.dae", b"<COLLADA/>"), MeshFault::Format("dae".into()));
        assert_eq!(said("a", b""), MeshFault::Format(String::new()));
        assert_eq!(said("a.stl", b"solid a\nendsolid a\n"), MeshFault::Empty);
        assert_eq!(said("a.stl", b"solid a\nvertex 1 2\n"), MeshFault::Broken);
        assert_eq!(said("a.stl", &[7; 200]), MeshFault::Broken);
        assert_eq!(said("a.obj", b"v 0 0 0\nf 1 2 3\n"), MeshFault::Broken);
        assert_eq!(said("a.obj", b"v 0 0 inf\nv 0 0 1\nv 1 0 0\nf 1 2 3\n"), MeshFault::Broken);
    }
}
