//! Whether what was said of an object was right, and how often it is for how much confidence.

use trueup::alignment::vision::Sighting;

/// So far off a place is still right, m, or within two of its standard deviations.
const RIGHT: f64 = 0.020;

#[derive(Default)]
pub(crate) struct Tally {
    /// There, found, off by (m), right, confidence.
    rows: Vec<(bool, bool, f64, bool, f64)>,
}

impl Tally {
    pub(crate) fn add(&mut self, case: &str, s: &Sighting, truth: &[[f64; 2]]) {
        let off = s.world_from_object.map_or(f64::NAN, |pose| {
            let at = pose.origin();
            truth.iter().map(|t| (at.x - t[0]).hypot(at.y - t[1])).fold(f64::INFINITY, f64::min)
        });
        let there = !truth.is_empty();
        let right = if s.found { there && (off < RIGHT || off < 2.0 * s.std) } else { !there };
        self.rows.push((there, s.found, off, right, s.confidence));
        let word = match (s.found, right) {
            (true, true) => "right ",
            (true, false) => "WRONG ",
            (false, true) => "absent",
            (false, false) => "missed",
        };
        println!(
            "{word} {case}: {} {:.0} mm ± {:.1}, confidence {:.2}; {}",
            s.name,
            1e3 * off,
            1e3 * s.std,
            s.confidence,
            s.reason.as_deref().or(s.ambiguous.as_deref()).unwrap_or("-"),
        );
    }

    pub(crate) fn print(&self) {
        let there = self.rows.iter().filter(|r| r.0).count();
        let found = self.rows.iter().filter(|r| r.0 && r.1 && r.3).count();
        let wrong = self.rows.iter().filter(|r| r.1 && !r.3).count();
        println!(
            "\n{} asked, {there} there: {found} found and right, {wrong} found and wrong",
            self.rows.len()
        );
        for (low, high) in [(0.0, 0.1), (0.1, 0.5), (0.5, 0.7), (0.7, 0.9), (0.9, 1.01)] {
            let said: Vec<_> =
                self.rows.iter().filter(|r| r.1 && r.4 >= low && r.4 < high).collect();
            let right = said.iter().filter(|r| r.3).count();
            if !said.is_empty() {
                println!(
                    "said {low:.1} to {:.1}: {right} of {} right",
                    f64::min(high, 1.0),
                    said.len()
                );
            }
        }
    }
}
