//! A cubic spline through samples: value, speed and acceleration between them.
//!
//! Source: de Boor, *A Practical Guide to Splines*, 1978, ch. IV (the not-a-knot end condition: a recording that
//! ends in motion ends with an acceleration, which natural ends would take away).

/// A cubic spline through `(t, y)`.
#[derive(Debug, Clone, PartialEq)]
pub struct Spline {
    t: Vec<f64>,
    y: Vec<f64>,
    /// Second derivative at each sample.
    curvature: Vec<f64>,
}

impl Spline {
    /// Returns the spline through `y` at strictly increasing `t`; at least two samples.
    pub fn through(t: &[f64], y: &[f64]) -> Self {
        let n = t.len();
        let mut curvature = vec![0.0; n];
        if n > 2 {
            // Thomas's algorithm on the tridiagonal system for the inner curvatures.
            let mut upper = vec![0.0; n];
            for i in 1..n - 1 {
                let (before, after) = (t[i] - t[i - 1], t[i + 1] - t[i]);
                let slope = (y[i + 1] - y[i]) / after - (y[i] - y[i - 1]) / before;
                let (mut left, mut middle, mut right) = (before, 2.0 * (before + after), after);
                if i == 1 && n > 3 {
                    middle += before + before * before / after;
                    right -= before * before / after;
                }
                if i == n - 2 && n > 3 {
                    middle += after + after * after / before;
                    left -= after * after / before;
                }
                let pivot = middle - left * upper[i - 1];
                upper[i] = right / pivot;
                curvature[i] = (6.0 * slope - left * curvature[i - 1]) / pivot;
            }
            for i in (1..n - 1).rev() {
                curvature[i] -= upper[i] * curvature[i + 1];
            }
            if n > 3 {
                let on = |i: usize, inner: usize, beyond: usize| {
                    let part = (t[i] - t[inner]) / (t[beyond] - t[inner]);
                    curvature[inner] + part * (curvature[beyond] - curvature[inner])
                };
                let ends = (on(0, 1, 2), on(n - 1, n - 2, n - 3));
                (curvature[0], curvature[n - 1]) = ends;
            }
        }
        Self { t: t.to_vec(), y: y.to_vec(), curvature }
    }

    /// Returns value, first and second derivative at `time`; beyond the ends it goes straight on.
    ///
    /// `hint` is where the last call looked; calls in order of time then need no search.
    pub fn at(&self, time: f64, hint: &mut usize) -> (f64, f64, f64) {
        let last = self.t.len() - 1;
        let clamped = time.clamp(self.t[0], self.t[last]);
        let mut i = (*hint).min(last - 1);
        while i > 0 && self.t[i] > clamped {
            i -= 1;
        }
        while i + 1 < last && self.t[i + 1] < clamped {
            i += 1;
        }
        *hint = i;
        let h = self.t[i + 1] - self.t[i];
        let (a, b) = ((self.t[i + 1] - clamped) / h, (clamped - self.t[i]) / h);
        let (ca, cb) = (self.curvature[i], self.curvature[i + 1]);
        let value = a * self.y[i]
            + b * self.y[i + 1]
            + ((a * a * a - a) * ca + (b * b * b - b) * cb) * h * h / 6.0;
        let slope = (self.y[i + 1] - self.y[i]) / h
            + ((3.0 * b * b - 1.0) * cb - (3.0 * a * a - 1.0) * ca) * h / 6.0;
        let beyond = time - clamped;
        if beyond.abs() > 0.0 {
            return (value + slope * beyond, slope, 0.0);
        }
        (value, slope, a * ca + b * cb)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sine_comes_back_with_its_derivatives() {
        let t: Vec<f64> = (0..=200).map(|i| f64::from(i) * 0.01).collect();
        let y: Vec<f64> = t.iter().map(|t| (3.0 * t).sin()).collect();
        let spline = Spline::through(&t, &y);
        let mut hint = 0;
        for time in [0.5, 0.503, 1.234_5, 0.777] {
            let (value, slope, curvature) = spline.at(time, &mut hint);
            assert!((value - (3.0 * time).sin()).abs() < 1e-8);
            assert!((slope - 3.0 * (3.0 * time).cos()).abs() < 1e-5);
            assert!((curvature + 9.0 * (3.0 * time).sin()).abs() < 2e-3);
        }
        let (value, slope, _) = spline.at(2.1, &mut hint);
        let (end, at_end, _) = spline.at(2.0, &mut hint);
        assert!((value - (end + 0.1 * at_end)).abs() < 1e-12 && (slope - at_end).abs() < 1e-12);
    }
}
