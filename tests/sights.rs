//! Where lines of sight through the places of a picture meet the plane of a board: drawing one asks for millions, so what a
//! lens does is worked out at the corners of pixels and taken evenly between them (right to some ten-thousandths of a pixel).

use nalgebra::{Matrix3, Vector2, Vector3};
use trueup::world::{Camera, Pixel};

pub(crate) struct Sights {
    columns: usize,
    /// Row by row, one more of each than there are pixels.
    at_corners: Vec<Vector2<f64>>,
    eye: Vector3<f64>,
    turn: Matrix3<f64>,
}

impl Sights {
    pub(crate) fn of(camera: &Camera) -> Self {
        let k = camera.intrinsics;
        let columns = k.width as usize + 1;
        let corners = columns * (k.height as usize + 1);
        let corner =
            |at: usize| Pixel::new((at % columns) as f64 - 0.5, (at / columns) as f64 - 0.5);
        let turn = camera.world_from_camera.rotation().to_rotation_matrix().into_inner();
        Self {
            columns,
            at_corners: (0..corners).map(|at| k.normalise(corner(at))).collect(),
            eye: camera.world_from_camera.origin(),
            turn,
        }
    }

    /// Where the plane z = 0 is seen at (u, v) px, m; `None` where it is behind the camera.
    pub(crate) fn on_plane(&self, u: f64, v: f64) -> Option<[f64; 2]> {
        let rows = self.at_corners.len() / self.columns;
        let whole = |x: f64, n: usize| (x.max(0.0) as usize).min(n - 2);
        let (i, j) = (whole(u + 0.5, self.columns), whole(v + 0.5, rows));
        let (a, b) = (u + 0.5 - i as f64, v + 0.5 - j as f64);
        let first = j * self.columns + i;
        let row = |at: usize| self.at_corners[at] * (1.0 - a) + self.at_corners[at + 1] * a;
        let n = row(first) * (1.0 - b) + row(first + self.columns) * b;
        let ray = self.turn * Vector3::new(n.x, n.y, 1.0);
        let far = -self.eye.z / ray.z;
        (far > 0.0).then(|| [self.eye.x + far * ray.x, self.eye.y + far * ray.y])
    }
}
