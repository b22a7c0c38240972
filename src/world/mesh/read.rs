//! Files of meshes: bytes in, triangles out.
//!
//! STL (binary and text) and OBJ are read; a COLLADA file (`.dae`) is not, nor is anything else. Where a file lies is for
//! whoever names it: a URDF in [`crate::motion::mesh`], a scene beside itself. What the triangles enclose is
//! [`super::Mesh`]'s.
//!
//! Source: 3D Systems, "`StereoLithography` Interface Specification", 1988; Wavefront, "Object Files (.obj)", 1992.

use std::path::Path;

use nalgebra::Vector3;

/// Three corners, m.
pub type Triangle = [Vector3<f64>; 3];

/// The largest mesh that is read, bytes: ten times the largest visual mesh of a UR10.
pub const LARGEST: u64 = 64 << 20;
/// So many triangles are read at most; the collision meshes of makers have some hundreds to some thousands.
const MOST_TRIANGLES: usize = 400_000;
/// Bytes before the triangles of a binary STL, and of each of them.
const STL_HEAD: usize = 84;
const STL_TRIANGLE: usize = 50;

/// Why a file's bytes are no mesh.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Unread {
    /// A format that is not read.
    #[error("{} is not read, only STL and OBJ are", if .0.is_empty() { "a file without an ending" } else { .0 })]
    Format(String),
    /// Text or bytes that are not what the name says.
    #[error("it is damaged")]
    Broken,
    /// Nothing in it.
    #[error("it has no triangle")]
    Empty,
    /// More in it than anything here needs.
    #[error("it has more than {0} triangles")]
    TooLarge(usize),
}

/// Returns the triangles of a mesh, its corners stretched by `scale` along the axes.
///
/// # Errors
///
/// [`Unread::Format`] for a format that is not read, [`Unread::Broken`] and [`Unread::TooLarge`] for a file
/// that is not what its name says or has too many triangles, [`Unread::Empty`] without a triangle.
pub fn triangles(name: &str, bytes: &[u8], scale: &Vector3<f64>) -> Result<Vec<Triangle>, Unread> {
    let mut found = reader_of(name)?(bytes)?;
    if found.is_empty() {
        return Err(Unread::Empty);
    }
    for corner in found.iter_mut().flatten() {
        corner.component_mul_assign(scale);
        if corner.iter().any(|x| !x.is_finite()) {
            return Err(Unread::Broken);
        }
    }
    Ok(found)
}

/// What reads a format.
pub type Reader = fn(&[u8]) -> Result<Vec<Triangle>, Unread>;

/// Returns what reads a mesh of this name.
///
/// # Errors
///
/// [`Unread::Format`] when nothing does.
pub fn reader_of(name: &str) -> Result<Reader, Unread> {
    let ending = Path::new(name).extension().map(|e| e.to_string_lossy().to_lowercase());
    match ending.as_deref() {
        Some("stl") => Ok(stl),
        Some("obj") => Ok(obj),
        other => Err(Unread::Format(other.unwrap_or_default().to_owned())),
    }
}

fn stl(bytes: &[u8]) -> Result<Vec<Triangle>, Unread> {
    let count = bytes.get(80..STL_HEAD).and_then(|b| Some(u32::from_le_bytes(b.try_into().ok()?)));
    let count = count.map_or(0, |count| count as usize);
    let fits = bytes.len() >= STL_HEAD && (bytes.len() - STL_HEAD) / STL_TRIANGLE == count;
    // A binary file may begin with the word of a text as well; its length tells.
    if !fits && bytes.starts_with(b"solid") {
        return stl_text(bytes);
    }
    if !fits {
        return Err(Unread::Broken);
    }
    if count > MOST_TRIANGLES {
        return Err(Unread::TooLarge(MOST_TRIANGLES));
    }
    let number = |b: &[u8]| f32::from_le_bytes([b[0], b[1], b[2], b[3]]);
    let corner = |b: &[u8]| {
        Vector3::new(number(&b[..4]), number(&b[4..8]), number(&b[8..12])).map(f64::from)
    };
    // The normal comes first; it is not needed.
    let triangle = |b: &[u8]| [corner(&b[12..24]), corner(&b[24..36]), corner(&b[36..48])];
    Ok(bytes[STL_HEAD..].chunks_exact(STL_TRIANGLE).map(triangle).collect())
}

fn stl_text(bytes: &[u8]) -> Result<Vec<Triangle>, Unread> {
    let text = std::str::from_utf8(bytes).map_err(|_| Unread::Broken)?;
    let mut corners = Vec::new();
    for line in text.lines() {
        if let Some(numbers) = line.trim_start().strip_prefix("vertex") {
            corners.push(corner_of(numbers)?);
        }
    }
    let (triangles, rest) = corners.as_chunks::<3>();
    if !rest.is_empty() {
        return Err(Unread::Broken);
    }
    if triangles.len() > MOST_TRIANGLES {
        return Err(Unread::TooLarge(MOST_TRIANGLES));
    }
    Ok(triangles.to_vec())
}

fn obj(bytes: &[u8]) -> Result<Vec<Triangle>, Unread> {
    let text = std::str::from_utf8(bytes).map_err(|_| Unread::Broken)?;
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
            return Err(Unread::TooLarge(MOST_TRIANGLES));
        }
    }
    Ok(triangles)
}

/// Returns the corner that a face names: `7`, `7/1/3`, or from the end `-1`.
fn corner_at(corners: &[Vector3<f64>], place: &str) -> Result<Vector3<f64>, Unread> {
    let number = place.split('/').next().and_then(|n| n.parse::<i64>().ok());
    let index = number.and_then(|number| match number {
        1.. => usize::try_from(number - 1).ok(),
        0 => None,
        _ => corners.len().checked_sub(usize::try_from(number.unsigned_abs()).ok()?),
    });
    index.and_then(|index| corners.get(index)).copied().ok_or(Unread::Broken)
}

fn corner_of(numbers: &str) -> Result<Vector3<f64>, Unread> {
    let mut each = numbers.split_whitespace().map(str::parse::<f64>);
    let mut next = || each.next().and_then(Result::ok).ok_or(Unread::Broken);
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
        assert_eq!(said("a.dae", b"<COLLADA/>"), Unread::Format("dae".into()));
        assert_eq!(said("a", b""), Unread::Format(String::new()));
        assert_eq!(said("a.stl", b"solid a\nendsolid a\n"), Unread::Empty);
        assert_eq!(said("a.stl", b"solid a\nvertex 1 2\n"), Unread::Broken);
        assert_eq!(said("a.stl", &[7; 200]), Unread::Broken);
        assert_eq!(said("a.obj", b"v 0 0 0\nf 1 2 3\n"), Unread::Broken);
        assert_eq!(said("a.obj", b"v 0 0 inf\nv 0 0 1\nv 1 0 0\nf 1 2 3\n"), Unread::Broken);
    }
}
