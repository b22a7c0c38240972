//! Smoothing kernels and what a wall adds to them.
//!
//! Near a wall part of a kernel's ball lies where no particles can be; the fluid there looks too thin
//! and would be drawn into the wall. [`Kernel::beyond`] is the part of the kernel that lies beyond a
//! plane, in closed form; counted as fluid, it makes density right up to the wall.
//!
//! Source: Müller, Charypar and Gross, "Particle-based fluid simulation for interactive applications",
//! 2003 (poly6 and spiky kernels). The half-space integrals are derived here.

use std::f32::consts::PI;

/// Both kernels for one support radius.
#[derive(Debug, Clone, Copy)]
pub struct Kernel {
    /// Support radius, m.
    pub h: f32,
    poly6: f32,
    spiky: f32,
    plane: f32,
}

impl Kernel {
    /// Returns the kernels of support radius `h` m.
    pub fn new(h: f32) -> Self {
        let h6 = h.powi(6);
        Self {
            h,
            poly6: 315.0 / (64.0 * PI * h.powi(9)),
            spiky: 45.0 / (PI * h6),
            plane: 30.0 / h6,
        }
    }

    /// Returns the poly6 kernel at squared distance `r2`, 1/m³.
    pub fn weight(&self, r2: f32) -> f32 {
        let d = (self.h * self.h - r2).max(0.0);
        self.poly6 * d * d * d
    }

    /// Returns how fast the spiky kernel falls at distance `r`, 1/m⁴ (positive).
    pub fn slope(&self, r: f32) -> f32 {
        let d = (self.h - r).max(0.0);
        self.spiky * d * d
    }

    /// Returns the part of the poly6 kernel beyond a plane at distance `d`, 0..1; `d` may be negative.
    pub fn beyond(&self, d: f32) -> f32 {
        let t = (d / self.h).clamp(-1.0, 1.0);
        let t2 = t * t;
        let odd = t * (1.0 + t2 * (-4.0 / 3.0 + t2 * (6.0 / 5.0 + t2 * (-4.0 / 7.0 + t2 / 9.0))));
        (0.5 - 315.0 / 256.0 * odd).clamp(0.0, 1.0)
    }

    /// Returns how fast the part of the spiky kernel beyond the plane falls with `d`, 1/m (positive).
    pub fn beyond_slope(&self, d: f32) -> f32 {
        // The kernel's integral over the plane: 30/h⁶ ∫ u³ (h - u) du from 0 to h - |d|.
        let u = (self.h - d.abs()).max(0.0);
        let u4 = u * u * u * u;
        self.plane * u4 * (self.h / 4.0 - u / 5.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_kernels_integrate_to_one() {
        let kernel = Kernel::new(0.01);
        let (n, mut poly, mut spiky) = (20_000, 0.0_f64, 0.0_f64);
        let dr = f64::from(kernel.h) / f64::from(n);
        for i in 0..n {
            let r = (f64::from(i) + 0.5) * dr;
            let shell = 4.0 * std::f64::consts::PI * r * r * dr;
            poly += shell * f64::from(kernel.weight((r * r) as f32));
            // ∫ W dV = ∫ (4/3) π r³ (-W') dr for a kernel that ends at h.
            spiky += shell * r / 3.0 * f64::from(kernel.slope(r as f32));
        }
        assert!((poly - 1.0).abs() < 1e-4, "{poly}");
        assert!((spiky - 1.0).abs() < 1e-4, "{spiky}");
    }

    #[test]
    fn the_part_beyond_a_plane_is_the_sum_over_it() {
        let kernel = Kernel::new(0.01);
        for d in [0.0_f32, 0.002, 0.005, 0.009] {
            // Sum the kernel over a fine grid of the half-space.
            let (n, mut sum) = (80, 0.0_f64);
            let cell = 2.0 * kernel.h / n as f32;
            for i in 0..n {
                for j in 0..n {
                    for k in 0..n {
                        let at = |i: i32| (i as f32 + 0.5) * cell - kernel.h;
                        let (x, y, z) = (at(i), at(j), at(k));
                        if x > d {
                            sum += f64::from(kernel.weight(x * x + y * y + z * z) * cell.powi(3));
                        }
                    }
                }
            }
            assert!((sum - f64::from(kernel.beyond(d))).abs() < 0.02, "{d}: {sum}");
        }
        assert!((kernel.beyond(0.0) - 0.5).abs() < 1e-6 && kernel.beyond(0.01) < 1e-6);
    }
}
