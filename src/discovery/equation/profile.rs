//! Whether recordings determine the model's own numbers: what is left along each of them, the others following.
//!
//! A deviation is told by how what is left bends where the fit ended. A number that the motion does not exercise ends somewhere
//! in the noise, in a free oscillation of the first values for one, and the bend there is that of the noise it follows. So each
//! number is moved far, by its deviation and by its own size: what fits as well there was not determined.
//!
//! Source: Raue et al., "Structural and Practical Identifiability Analysis of Partially Observed Dynamical Models by Exploiting
//! the Profile Likelihood", 2009.

use super::compile::Compiled;
use super::estimate::Estimate;
use super::hypothesis::{Hypothesis, Question};
use super::score::twice_log_ratio;

/// A number is moved by so many of its standard deviations: where what is left bends as it does at the fit, it grows by the
/// square of that, more than by any cost of the numbers in a model of usual size.
const FAR: f64 = 8.0;
/// It is moved at least by this part of itself.
const LARGE: f64 = 0.5;
/// And by so many times that as well, before it counts as not determined.
const FARTHER: f64 = 4.0;
/// Iterations in which the others follow. Chosen: what needs more was determined by where they stood.
const FOLLOWED: usize = 12;

impl Question<'_> {
    /// Returns the names of the parameters of `given` that fit as well far from where they ended in `at`, although they have a
    /// standard deviation there.
    pub(super) fn undetermined(&self, given: &Compiled, at: &Hypothesis) -> Vec<String> {
        let params = given.params.iter().map(|param| &param.name);
        params.filter(|name| self.is_undetermined(name, at)).cloned().collect()
    }

    fn is_undetermined(&self, name: &str, at: &Hypothesis) -> bool {
        let (compiled, train) = (&at.fitted.compiled, &at.fitted.train);
        let Some(i) = compiled.params.iter().position(|param| param.name == name) else {
            return false;
        };
        let (value, std) = (train.point.params[i], train.std[i]);
        if !(std.is_finite() && std > 0.0) {
            return false;
        }
        let counts = train.sums.iter().map(|(_, n)| *n as f64);
        let effective: Vec<f64> = at.whites[0].iter().zip(counts).map(|(w, n)| w * n).collect();
        let total: f64 = effective.iter().sum();
        // What noise may gain by numbers and first values that follow it: no more than they cost.
        let noise = (compiled.params.len() + compiled.states.len()) as f64 * total.max(2.0).ln();
        let fits = |there: f64| {
            let worse = |moved: Estimate| {
                twice_log_ratio(&moved.sums, &train.sums, &effective, &self.floors)
            };
            self.moved(at, i, there).is_some_and(|moved| worse(moved) < noise)
        };
        let reach = (FAR * std).max(LARGE * value.abs());
        let range = compiled.params[i].range;
        let is_inside = |there: &f64| range.is_none_or(|[low, high]| (low..=high).contains(there));
        [-reach, reach].into_iter().any(|way| {
            let places = [value + way, value + FARTHER * way].into_iter().filter(is_inside);
            let places: Vec<f64> = places.collect();
            !places.is_empty() && places.into_iter().all(fits)
        })
    }

    /// Fits everything else with one parameter somewhere; `None` where the model blows up there.
    fn moved(&self, at: &Hypothesis, param: usize, there: f64) -> Option<Estimate> {
        let model = &at.fitted.compiled;
        let mut task = self.bench.task(model);
        task.held.push(param);
        let mut point = at.fitted.train.point.clone();
        point.params[param] = there;
        let is_alone = task.held.len() >= model.params.len()
            && point.starts.iter().flatten().flatten().next().is_none();
        let moved =
            if is_alone { task.judge(&point).ok() } else { task.fit(&point, FOLLOWED).ok() };
        moved.filter(|estimate| estimate.residuals.iter().all(|left| !left.is_empty()))
    }
}

#[cfg(test)]
mod tests {
    use super::super::edit::model_in;
    use super::super::estimate::Point;
    use super::super::fitting::Fitted;
    use super::super::made::unseen;
    use super::*;

    const TEXT: &str = "model m {\n input u\n param k = free ~ 5\n state x = free\n x' = k*(u - x)\n output x = x\n}\n";

    /// Which numbers the motion that an input makes leaves open, and the deviation that a fit has for the only one.
    fn asked(input: fn(f64) -> f64) -> (Vec<String>, f64) {
        let mut bench = unseen(60, 1e-3, input);
        let compiled = bench.prepare(TEXT, "m").unwrap();
        let truth = Point { params: vec![0.8], starts: vec![vec![Some(input(0.0) + 1e-3)]] };
        let values = bench.task(&compiled).run(&truth).unwrap();
        let noise = (0..60).map(|row| 1e-3 * (37.0 * f64::from(row)).sin());
        let seen: Vec<f64> = values.iter().zip(noise).map(|(value, noise)| value + noise).collect();
        bench.train[0].outputs[0].clone_from(&seen);
        bench.held[0].outputs[0] = seen;
        let train = bench.task(&compiled).fit(&truth, 60).unwrap();
        let fitted = Fitted { text: TEXT.into(), compiled: compiled.clone(), train };
        let given = model_in(TEXT, "m").unwrap();
        let (floors, refused, whole) = (vec![0.0], Vec::new(), [1.0; 2]);
        let question = Question { bench, name: "m", given, floors, refused, whole };
        let at = question.judged(Vec::new(), fitted, None).unwrap();
        (question.undetermined(&compiled, &at), at.fitted.train.std[0])
    }

    #[test]
    fn a_rate_that_only_noise_tells_is_not_determined() {
        let (open, std) = asked(|_| 1.0);
        assert!(std > 0.0 && std.is_finite(), "the fit has a deviation for it: {std}");
        assert_eq!(open, ["k"]);
    }

    #[test]
    fn a_rate_that_a_motion_tells_is_determined() {
        let (open, std) = asked(|row| (0.3 * row).sin());
        assert!(open.is_empty(), "± {std}");
    }
}
