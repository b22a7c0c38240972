//! Whether what was said of an object was right, and how often it is for how much confidence.

use trueup::alignment::vision::Sighting;

/// So far off a place is still right, m, or within two of its standard deviations.
const RIGHT: f64 = 0.020;

#[derive(Default)]
pub(crate) struct Tally {
    /// There, found, off by (m), right, confidence.
    rows: Vec<(bool, bool, f64, bool, f64)>,
    /// Of each refusal with a likeliest place of a thing that is there: off by (m), its deviation if it is there (m).
    refused: Vec<(f64, f64)>,
    /// What each placement rests on, as `scripts/sight_weights.py` reads it.
    evidence: Vec<String>,
}

/// The columns of [`Tally::evidence`].
pub(crate) const COLUMNS: &str = "picture,object,is_clear,is_right,is_there,confidence,score,weakest,cut,elsewhere,shape,gap,missing,apart,std,off";

impl Tally {
    /// What every placement rests on, found or not, and whether it was right.
    pub(crate) fn evidence(&self) -> String {
        format!("{COLUMNS}\n{}\n", self.evidence.join("\n"))
    }

    /// Keeps what a placement rests on, and of a refusal how far off its likeliest place is.
    pub(crate) fn keep(&mut self, case: &str, s: &Sighting, truth: &[[f64; 2]], is_clear: bool) {
        let Some(pose) = s.world_from_object.or(s.likeliest) else { return };
        let at = pose.origin();
        let far = |t: &[f64; 2]| (at.x - t[0]).hypot(at.y - t[1]);
        let off = truth.iter().map(far).fold(f64::INFINITY, f64::min);
        if !s.found && !truth.is_empty() {
            self.refused.push((off, s.std_if_there));
        }
        let is_right = off < RIGHT || off < 2.0 * s.std_if_there;
        let of = |value: Option<f64>| value.map_or(String::new(), |v| format!("{v:.5}"));
        let identity = s.checks.identity;
        self.evidence.push(format!(
            "{},{},{},{},{},{:.4},{:.5},{:.5},{},{:.5},{:.5},{:.5},{:.5},{},{:.5},{off:.4}",
            case.replace(',', ";"),
            s.name,
            u8::from(is_clear),
            u8::from(is_right),
            u8::from(!truth.is_empty()),
            s.confidence,
            s.score.total,
            s.score.weakest,
            of(s.checks.mask_iou),
            identity.elsewhere,
            identity.shape,
            s.gap,
            s.checks.missing,
            of(s.checks.apart),
            s.std_if_there,
        ));
    }

    pub(crate) fn add(&mut self, case: &str, s: &Sighting, truth: &[[f64; 2]], is_clear: bool) {
        self.keep(case, s, truth, is_clear);
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
        let near = self.refused.iter().filter(|r| r.0 < RIGHT).count();
        let honest = self.refused.iter().filter(|r| r.0 < RIGHT && r.0 < 2.0 * r.1).count();
        println!(
            "{} refused with a likeliest place: {near} of them within 20 mm, of which {honest} within two deviations",
            self.refused.len()
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
