//! Water in words, with where what is said of it comes from: the scene, the hand that weighed it, the scales.
//!
//! How much there is and what a run's scales read are given; the words on a whole run are [`super::run`]'s.

use crate::units::Quantity;
use crate::workcell::Run;

use super::run::scales_of;

/// So far weighing in the hand may be off, m³: what `weighable` and `poured` of the standard library allow it.
const WEIGHED_WITHIN: f64 = 3e-6;
/// Volumes that differ by less are the same number, m³.
const SAME: f64 = 1e-12;

/// Words how much is in a vessel, m³, of which the scene says `declared` m³; in the twin alone nothing is weighed.
pub fn in_vessel(there: f64, declared: f64, is_simulated: bool) -> String {
    let volume = Quantity::cubic_metres(there);
    if (there - declared).abs() < SAME {
        format!("{volume}, as the scene says; not measured")
    } else if is_simulated {
        format!("{volume}, as simulated in the twin")
    } else {
        format!("{:.0} mL ± {:.0} mL, as weighed in the hand", 1e6 * there, 1e6 * WEIGHED_WITHIN)
    }
}

/// Words what the scales say of a vessel at the end of a run; `None` where they do not know it.
pub fn on_scales(run: &Run, vessel: &str) -> Option<String> {
    let water = run.water.as_ref()?;
    let (_, volume) = water.vessels_ml.iter().find(|(name, _)| name == vessel)?;
    let scales = scales_of(&water.measured_by);
    Some(format!("{volume:.1} mL on {scales} at the end of {}", run.task))
}

/// Words what the scales say of spilt water at the end of a run; `None` where none were read.
pub fn spilt(run: &Run) -> Option<String> {
    let water = run.water.as_ref()?;
    // Told to a tenth.
    let (begins, help) = if water.spilt_ml < 0.05 {
        ("nothing spilt", "")
    } else {
        ("spilt", "; `:why` says how it went")
    };
    let scales = scales_of(&water.measured_by);
    Some(format!("{begins} by the end of {}: {:.1} mL on {scales}{help}", run.task, water.spilt_ml))
}

#[cfg(test)]
mod tests {
    use super::{Run, in_vessel, on_scales, spilt};
    use crate::workcell::Water;

    fn poured(spilt_ml: f64) -> Run {
        let water = Water {
            in_target_ml: 148.0,
            in_source_ml: 0.3,
            vessels_ml: vec![("jar".into(), 0.3), ("cup".into(), 148.0)],
            spilt_ml,
            measured_by: "lab".into(),
        };
        Run { water: Some(water), ..Run::so_far("pour(jar, cup)", &[]) }
    }

    /// "Did it spill?" was answered with a help about something else, though the scales had said it.
    #[test]
    fn what_is_spilt_is_told_by_the_scales_of_the_last_run() {
        assert_eq!(spilt(&Run::so_far("look()", &[])), None);
        let told = spilt(&poured(0.04)).unwrap();
        assert_eq!(told, "nothing spilt by the end of pour(jar, cup): 0.0 mL on the lab's scales");
        let told = spilt(&poured(3.21)).unwrap();
        assert!(told.starts_with("spilt by the end of pour(jar, cup): 3.2 mL on"), "{told}");
        assert!(told.ends_with("`:why` says how it went"), "{told}");
    }

    /// "150 mL" was told as if it had been measured, and "0.577 mL" of what was weighed to 3 mL.
    #[test]
    fn what_is_in_a_vessel_is_told_with_where_that_comes_from() {
        assert_eq!(in_vessel(150e-6, 150e-6, false), "150 mL, as the scene says; not measured");
        assert_eq!(in_vessel(0.577e-6, 150e-6, false), "1 mL ± 3 mL, as weighed in the hand");
        assert_eq!(in_vessel(40e-6, 150e-6, true), "40 mL, as simulated in the twin");
        let told = on_scales(&poured(0.0), "jar").unwrap();
        assert_eq!(told, "0.3 mL on the lab's scales at the end of pour(jar, cup)");
        assert_eq!(on_scales(&poured(0.0), "mug"), None);
    }
}
