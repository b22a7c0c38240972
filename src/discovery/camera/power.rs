//! The power of the test: how small an effect on the camera would still have been seen.

use super::explain::CameraGap;
use super::term::Law;
use crate::discovery::finding::Visible;
use crate::discovery::selection::{Options, Residuals as _, Set, sum_of_squares};

/// More than this many of the scales on which an effect is visible at a glance is as good as never.
const NEVER: f64 = 1e3;

/// Returns how small an effect of each common kind would have been seen, and the names of those that these pictures
/// could not show at all.
pub(super) fn smallest_visible(gap: &CameraGap, options: &Options) -> (Vec<Visible>, Vec<String>) {
    let (mut visible, mut blind) = (Vec::new(), Vec::new());
    let Some(base) = gap.residuals(Set::Train, &[], &[]) else { return (visible, blind) };
    let count = gap.count(Set::Train).max(2) as f64;
    for law in gap.named() {
        // Of every effect the forms with one number at a time.
        let shown = match law {
            Law::Radial(k2) | Law::Focal(k2) => !k2,
            Law::Principal(u, v) => u != v,
            Law::Shift(free) => free.iter().filter(|free| **free).count() == 1,
            Law::Table(tilt, height) => tilt != height,
            Law::Lift | Law::Feature(_) => false,
            Law::Tangential | Law::Delay | Law::Shutter => true,
        };
        if !shown {
            continue;
        }
        let specs = gap.specs(&law);
        let start: Vec<f64> = specs.iter().map(|spec| spec.neutral.unwrap_or(0.0)).collect();
        for (at, spec) in specs.iter().enumerate() {
            let mut moved = start.clone();
            moved[at] += spec.scale;
            let Some(with) = gap.residuals(Set::Train, &[law], &moved) else { continue };
            let difference: Vec<f64> = with.iter().zip(&base).map(|(a, b)| a - b).collect();
            let strength = sum_of_squares(&difference).sqrt() / spec.scale;
            let needed = (options.least_gain + specs.len() as f64 * count.ln()).sqrt();
            let least = needed / strength.max(1e-300);
            if least > NEVER * spec.scale {
                blind.push(format!("{} ({})", law.name(), spec.name));
                continue;
            }
            visible.push(Visible {
                name: law.name().into(),
                at: law.site().into(),
                parameter: spec.name.into(),
                least,
                unit: spec.unit.into(),
            });
        }
    }
    (visible, blind)
}
