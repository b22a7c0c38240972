//! The inside of a camera with all the terms that an effect may add: three radial, two tangential.

use nalgebra::Vector2;

use crate::world::{Intrinsics, LensModel};

/// A lens and a sensor: `u = fx x_d + skew y_d + cx`, `v = fy y_d + cy`, distorted as `OpenCV` does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lens {
    /// Focal length along u, px.
    pub fx: f64,
    /// Focal length along v, px.
    pub fy: f64,
    /// Principal point, u, px.
    pub cx: f64,
    /// Principal point, v, px.
    pub cy: f64,
    /// Skew, px.
    pub skew: f64,
    /// Radial distortion `k1`, `k2`, `k3`: factors of r², r⁴, r⁶.
    pub k: [f64; 3],
    /// Tangential distortion `p1`, `p2`.
    pub p: [f64; 2],
    /// Fourth radial distortion, of a fisheye only.
    pub k4: f64,
    /// What the terms mean: effects change those of the lens there is.
    pub model: LensModel,
}

impl Lens {
    /// Returns the pixel of normalised coordinates `x = X/Z`, `y = Y/Z`, px.
    pub fn pixel(&self, n: Vector2<f64>) -> Vector2<f64> {
        let pixel = self.intrinsics().pixel(n);
        Vector2::new(pixel.u, pixel.v)
    }

    /// Returns it as the world's camera model, without the size of the picture.
    pub fn intrinsics(&self) -> Intrinsics {
        Intrinsics {
            fx: self.fx,
            fy: self.fy,
            cx: self.cx,
            cy: self.cy,
            skew: self.skew,
            k1: self.k[0],
            k2: self.k[1],
            p1: self.p[0],
            p2: self.p[1],
            k3: self.k[2],
            k4: self.k4,
            model: self.model,
            width: 0,
            height: 0,
        }
    }
}

impl From<Intrinsics> for Lens {
    fn from(i: Intrinsics) -> Self {
        Self {
            fx: i.fx,
            fy: i.fy,
            cx: i.cx,
            cy: i.cy,
            skew: i.skew,
            k: [i.k1, i.k2, i.k3],
            p: [i.p1, i.p2],
            k4: i.k4,
            model: i.model,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_the_worlds_lens() {
        let mut inside = Intrinsics::centred(800.0, 640, 480);
        (inside.k1, inside.k2, inside.skew) = (-0.2, 0.05, 0.4);
        (inside.p1, inside.p2, inside.k3) = (1e-3, -2e-3, 0.1);
        let lens = Lens::from(inside);
        for n in [Vector2::new(0.3, -0.2), Vector2::new(-0.5, 0.4)] {
            let (ours, theirs) = (lens.pixel(n), inside.pixel(n));
            assert!((ours.x - theirs.u).abs() < 1e-12 && (ours.y - theirs.v).abs() < 1e-12);
        }
        assert_eq!(lens.intrinsics().matrix(), inside.matrix());
    }

    /// Worked by hand from Brown's formula: x = 0.2, y = 0.1, so r² = 0.05.
    #[test]
    fn the_tangential_terms_are_browns() {
        let mut lens = Lens::from(Intrinsics::centred(1.0, 1, 1));
        lens.p = [0.01, -0.02];
        let d = lens.pixel(Vector2::new(0.2, 0.1)) - Vector2::new(0.2, 0.1);
        assert!((d.x - (0.02 * 0.02 - 0.02 * 0.13)).abs() < 1e-15);
        assert!((d.y - (0.01 * 0.07 - 0.04 * 0.02)).abs() < 1e-15);
    }
}
