//! What the residuals of one joint hint at: orders of a ripple, frequencies of a hum, places where a spring may begin.
//!
//! They are where a fit begins; whether anything is there the search decides.

use std::f64::consts::TAU;

use super::channels::Quantity;
use super::simulate::Model;

/// Sine and cosine of `k·x` for every `x`, for one `k` after the other at even steps: each step turns every
/// pointer a little, and no sine is worked out again.
struct Pointers {
    sine: Vec<f64>,
    cosine: Vec<f64>,
    /// Sine and cosine of `step·x`.
    turns: Vec<(f64, f64)>,
}

impl Pointers {
    fn new(x: &[f64], first: f64, step: f64) -> Self {
        Self {
            sine: x.iter().map(|x| (first * x).sin()).collect(),
            cosine: x.iter().map(|x| (first * x).cos()).collect(),
            turns: x.iter().map(|x| (step * x).sin_cos()).collect(),
        }
    }

    fn turn(&mut self) {
        for ((sine, cosine), (s, c)) in self.sine.iter_mut().zip(&mut self.cosine).zip(&self.turns)
        {
            (*sine, *cosine) = (*sine * c + *cosine * s, *cosine * c - *sine * s);
        }
    }
}

/// One joint's residuals and motion, looked at through its own position loop alone.
pub(super) struct Scan {
    time: Vec<f64>,
    q: Vec<f64>,
    first_row: usize,
    /// Residuals of torque and position in units of noise, and the noise.
    torque: Option<(Vec<f64>, f64)>,
    position: Option<(Vec<f64>, f64)>,
    /// Inertia, kp, kd of the joint's loop; `None` without a controller.
    own: Option<(f64, f64, f64)>,
    /// Largest measured torque, N·m; 0 where none was measured.
    pub(super) largest_torque: f64,
}

impl Scan {
    /// Takes joint `j` out of a model; `left` are the residuals in units of noise.
    pub(super) fn new(model: &Model, j: usize, left: &[f64]) -> Self {
        let course = &model.course;
        let (data, plant) = (&course.data, &course.plant);
        let rows = data.n_rows();
        let (mut torque, mut position) = (None, None);
        let predicted = data.channels.iter().filter(|c| model.is_predicted(c.quantity));
        for (at, channel) in predicted.enumerate() {
            let part = || (left[at * rows..(at + 1) * rows].to_vec(), channel.noise);
            match channel.quantity {
                Quantity::Torque if channel.index == j => torque = Some(part()),
                Quantity::Position if channel.index == j => position = Some(part()),
                _ => {}
            }
        }
        let n = plant.n;
        let q = data
            .time
            .iter()
            .map(|time| {
                let k = ((time - plant.start) / plant.step).round() as usize;
                plant.q[k.min(plant.len - 1) * n + j]
            })
            .collect();
        let controller = model.arm.controller.as_ref().filter(|_| course.closed_loop);
        let own = controller.map(|controller| {
            let middle = plant.len / 2;
            let inverse = plant.inverse_mass[(middle * n + j) * n + j];
            (1.0 / inverse, controller.kp_nm_per_rad[j], controller.kd_nm_s_per_rad[j])
        });
        let largest_torque = data
            .measured(Quantity::Torque, j)
            .map_or(0.0, |values| values.iter().fold(0.0_f64, |most, value| most.max(value.abs())));
        Self {
            time: data.time.clone(),
            q,
            first_row: course.first_row,
            torque,
            position,
            own,
            largest_torque,
        }
    }

    /// Returns how much a disturbance of sine and cosine could explain of this joint's residuals.
    fn explains(&self, basis: [&[f64]; 2]) -> f64 {
        let mut columns: [Vec<f64>; 2] = [Vec::new(), Vec::new()];
        let mut target: Vec<f64> = Vec::new();
        for (column, disturbance) in columns.iter_mut().zip(basis) {
            let (tau, q) = self.response(disturbance);
            if let Some((_, noise)) = &self.torque {
                column.extend(tau[self.first_row..].iter().map(|value| value / noise));
            }
            if let Some((_, noise)) = &self.position {
                column.extend(q[self.first_row..].iter().map(|value| value / noise));
            }
        }
        for (residual, _) in [&self.torque, &self.position].into_iter().flatten() {
            target.extend(&residual[self.first_row..]);
        }
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let [s, c] = &columns;
        let (ss, sc, cc) = (dot(s, s), dot(s, c), dot(c, c));
        let (st, ct) = (dot(s, &target), dot(c, &target));
        let determinant = ss * cc - sc * sc;
        if determinant < 1e-6 * ss * cc {
            return 0.0;
        }
        (cc * st * st - 2.0 * sc * st * ct + ss * ct * ct) / determinant
    }

    /// Returns what a torque at the joint changes in its torque and position channels.
    fn response(&self, disturbance: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let rows = disturbance.len();
        let Some((inertia, kp, kd)) = self.own else {
            return (disturbance.iter().map(|d| -d).collect(), vec![0.0; rows]);
        };
        let (mut tau, mut angle) = (vec![0.0; rows], vec![0.0; rows]);
        let (mut q, mut dq) = (disturbance[0] / kp.max(1e-9), 0.0);
        for row in 0..rows {
            angle[row] = q;
            tau[row] = -kp * q - kd * dq;
            if row + 1 == rows {
                break;
            }
            let span = self.time[row + 1] - self.time[row];
            let steps = (span / 2e-3).ceil().clamp(1.0, 1e3);
            let h = span / steps;
            for step in 0..steps as usize {
                let part = step as f64 / steps;
                let d = disturbance[row] + part * (disturbance[row + 1] - disturbance[row]);
                // Implicit in the damping, which may be stiff.
                dq = (dq + h * (d - kp * q) / inertia) / (1.0 + h * kd / inertia);
                q += h * dq;
            }
        }
        (tau, angle)
    }

    /// Returns the places of the best peaks of `score` over `grid`, best first.
    fn peaks(grid: &[f64], score: &[f64], count: usize) -> Vec<f64> {
        let mut peaks: Vec<(f64, f64)> = (0..grid.len())
            .filter(|&i| {
                (i == 0 || score[i] >= score[i - 1])
                    && (i + 1 == grid.len() || score[i] > score[i + 1])
            })
            .map(|i| (score[i], grid[i]))
            .collect();
        peaks.sort_by(|a, b| b.0.total_cmp(&a.0));
        peaks.into_iter().take(count).map(|(_, at)| at).collect()
    }

    /// Returns the orders of a ripple worth trying; none where the joint hardly turns.
    pub(super) fn orders(&self) -> Vec<f64> {
        let (low, high) =
            self.q.iter().fold((f64::MAX, f64::MIN), |(l, h), q| (l.min(*q), h.max(*q)));
        let range = high - low;
        if range < 0.05 {
            return Vec::new();
        }
        // Two orders closer than this look alike over the range; half a step still finds the peak.
        let step = (1.5 / range).clamp(0.05, 2.0);
        // Half a period must not be jumped over between rows, and a full one must fit in the range.
        let fastest =
            self.q.windows(2).map(|pair| (pair[1] - pair[0]).abs()).fold(0.0, f64::max).max(1e-6);
        let (first, last) = ((TAU / range).max(1.0), (1.2 / fastest).min(120.0));
        let count = (((last - first) / step).max(1.0) as usize).min(200);
        let grid: Vec<f64> = (0..count).map(|i| first + step * i as f64).collect();
        let mut pointers = Pointers::new(&self.q, first, step);
        let score: Vec<f64> = grid
            .iter()
            .map(|_| {
                let score = self.explains([&pointers.sine, &pointers.cosine]);
                pointers.turn();
                score
            })
            .collect();
        Self::peaks(&grid, &score, 2)
    }

    /// Returns the frequencies of a hum worth trying, Hz.
    pub(super) fn frequencies(&self) -> Vec<f64> {
        let Some((residual, _)) = self.torque.as_ref().or(self.position.as_ref()) else {
            return vec![1.0];
        };
        let rows = residual.len();
        let span = self.time[rows - 1] - self.time[0];
        let rate = (rows - 1) as f64 / span;
        // From one period in the recording to half the sampling rate, two points to a line's width.
        let step = 0.5 / span;
        let count = ((0.45 * rate / step) as usize).min(1200);
        let grid: Vec<f64> = (2..count.max(3)).map(|i| step * i as f64).collect();
        let since: Vec<f64> = self.time.iter().map(|time| TAU * (time - self.time[0])).collect();
        let mut pointers = Pointers::new(&since, 2.0 * step, step);
        let dot = |a: &[f64]| a.iter().zip(residual).map(|(a, b)| a * b).sum::<f64>();
        let score: Vec<f64> = grid
            .iter()
            .map(|_| {
                let score = dot(&pointers.sine).powi(2) + dot(&pointers.cosine).powi(2);
                pointers.turn();
                score
            })
            .collect();
        Self::peaks(&grid, &score, 1)
    }

    /// Returns places within the range of motion where a one-sided spring could begin.
    pub(super) fn edges(&self) -> Vec<f64> {
        let (low, high) =
            self.q.iter().fold((f64::MAX, f64::MIN), |(l, h), q| (l.min(*q), h.max(*q)));
        [0.1, 0.3, 0.5, 0.7, 0.9].iter().map(|part| low + part * (high - low)).collect()
    }
}
