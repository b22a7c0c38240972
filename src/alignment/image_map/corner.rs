//! A map with a 1 in its corner.

use super::Error;
use nalgebra::Matrix3;

/// Divides by the corner.
pub(super) fn with_unit_corner(m: Matrix3<f64>) -> Result<Matrix3<f64>, Error> {
    let corner = m[(2, 2)];
    // Rounding leaves about 1e-16 of the largest entry where the corner should be 0.
    if corner.abs() <= 1e-13 * m.amax() || !corner.is_finite() {
        return Err(Error::OriginAtInfinity);
    }
    Ok(m / corner)
}
