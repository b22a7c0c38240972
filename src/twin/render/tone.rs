//! How bright light is told apart, and how it becomes bytes. What light there is, is [`super::light`]'s.

use std::sync::LazyLock;

use nalgebra::Vector3;
use wide::{f32x4, i32x4};

/// The sRGB transfer function: linear light (clamped to 0–1) to 0–1.
pub fn srgb(x: f32) -> f32 {
    let x = x.clamp(0.0, 1.0);
    if x <= 0.003_130_8 { 12.92 * x } else { 1.055 * x.powf(1.0 / 2.4) - 0.055 }
}

/// Makes sRGB bytes of linear light, from a table: a picture asks three million times.
#[inline]
pub fn develop(light: &[f32], bytes: &mut [u8]) {
    let table: &[u8; 16384] = &DEVELOPED;
    let (bytes, rest) = bytes.as_chunks_mut::<4>();
    let (light, last) = light.as_chunks::<4>();
    for (bytes, light) in bytes.iter_mut().zip(light) {
        let steps = f32x4::from(*light).fast_max(f32x4::splat(0.0)).fast_min(f32x4::splat(1.0))
            * f32x4::splat(STEPS)
            + f32x4::splat(0.5);
        // Written out: a closure over an array is a call.
        let steps = (steps.fast_trunc_int() & i32x4::splat(16383)).to_array();
        for k in 0..4 {
            bytes[k] = table[steps[k] as usize & 16383];
        }
    }
    for (byte, light) in rest.iter_mut().zip(last) {
        *byte = table[(light.clamp(0.0, 1.0) * STEPS + 0.5) as usize];
    }
}

/// Steps of [`DEVELOPED`] from no light to full light. The steepest byte of the curve is 1/(255·12.92) wide, five steps.
const STEPS: f32 = 16383.0;

/// Bytes of light.
static DEVELOPED: LazyLock<[u8; 16384]> =
    LazyLock::new(|| std::array::from_fn(|k| (srgb(k as f32 / STEPS) * 255.0 + 0.5) as u8));

/// The brightest light that is told apart.
pub(super) const BRIGHTEST: f32 = 4.0;

/// Highlights are cut where a sensor's pixel would be full several times over; else one bright look would
/// outweigh all others of an edge.
#[inline]
pub(super) fn clamped(light: Vector3<f64>) -> [f32; 3] {
    let cut = |x: f64| (x as f32).clamp(0.0, BRIGHTEST);
    [cut(light.x), cut(light.y), cut(light.z)]
}
