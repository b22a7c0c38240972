//! How good an answer is: every picture left out in turn, and the squares measured by the robot's travel.
//!
//! A picture that was left out tells where the middle of what it sees of the board is, and the others predict it; their distance is
//! the error that someone who uses the calibration meets, in the robot's base. The squares' size is one more parameter of the fit:
//! pictures alone know no length, so the robot's travel measures them.
//!
//! Source of the second standard deviation: Efron and Tibshirani, *An Introduction to the Bootstrap*, 1993, eq. 11.5
//! (jackknife).

use nalgebra::{Isometry3, Point3, Vector2, Vector3, Vector6};

use super::motions::Motions;
use super::refine::{BOARD, CAMERA, CUT, Fitted, Refine, SCALE};
use super::types::{HandEye, LeftOut, Mount, Placed, Square, View, ViewFit};

/// Squares off by more standard deviations than this are of another size. Chosen: the noise is estimated from ten to twenty
/// pictures, whose errors are not independent.
const SURE: f64 = 4.0;
/// Squares within this part of what was said are as said: robots' own lengths are not much better known.
const NEAR: f64 = 0.01;
/// Units that are taken for each other: m, cm and mm, and inches for mm, cm and m.
const UNITS: [f64; 6] = [1000.0, 100.0, 10.0, 25.4, 2.54, 1.0 / 0.0254];
/// A ratio within this part of a unit's is that unit. Chosen: squares are seldom off by as much at the same time.
const UNIT: f64 = 0.2;
/// A row that fits a picture by as many times better than every other row is the picture's. Derived: of rows that are spread evenly
/// in six numbers, the nearest one is so much nearer than the next by chance with a probability of 1/20^6.
const FAR: f64 = 20.0;

impl Square {
    /// Returns how many times too large the robot's travel is, if that is the ratio of two units.
    pub(super) fn other_unit(&self) -> Option<f64> {
        let times = self.measured / self.said;
        let is = |unit: f64| (times / unit - 1.0).abs() < UNIT;
        let ratios = UNITS.iter().flat_map(|&unit| [unit, 1.0 / unit]);
        // Nearer ones are squares of another size.
        ratios.filter(|unit| !(0.2..5.0).contains(unit)).find(|&unit| is(unit))
    }
}

impl Refine<'_> {
    /// Returns the size of the squares by a fit that left it free.
    pub(super) fn square(&self, free: &Fitted) -> Square {
        let (said, of) = self.board.side();
        let used: Vec<usize> = (0..self.robot.len()).filter(|&i| free.is_used(i)).collect();
        let each: Vec<f64> =
            used.iter().filter_map(|&i| self.without(free, i).ok().map(|f| f.scale.ln())).collect();
        let n = each.len().max(1) as f64;
        let mean = each.iter().sum::<f64>() / n;
        let jackknife =
            ((n - 1.0) / n * each.iter().map(|s| (s - mean).powi(2)).sum::<f64>()).sqrt();
        let relative = free.fit.std(SCALE).max(jackknife);
        let off = free.scale.ln().abs();
        let is_wrong = off > SURE * relative && off > NEAR && used.len() > 3;
        Square {
            of,
            said,
            measured: said * free.scale,
            std: said * free.scale * relative,
            is_wrong,
        }
    }

    /// The middle of what a picture sees of the board, in the board's coordinates.
    fn middle(&self, picture: usize, scale: f64) -> Point3<f64> {
        Point3::from(self.sights[picture].middle * scale)
    }

    /// Where a picture sees the board, in the base; and where the robot and the board's place put it.
    fn in_base(&self, fitted: &Fitted, picture: usize) -> (Isometry3<f64>, Isometry3<f64>) {
        let flange = self.robot[picture];
        let board = fitted.camera * self.seen(picture, &fitted.fit.x, fitted.scale).inverse();
        match self.mount {
            Mount::Wrist => (flange * board, fitted.board),
            Mount::Fixed => (board, flange * fitted.board),
        }
    }

    /// What a fit says of a picture that it did not see.
    fn left_out(&self, fitted: &Fitted, picture: usize) -> LeftOut {
        let (seen, predicted) = self.in_base(fitted, picture);
        let middle = self.middle(picture, fitted.scale);
        LeftOut {
            position: (seen * middle - predicted * middle).norm(),
            rotation: seen.rotation.angle_to(&predicted.rotation),
        }
    }

    /// How far the pictures put what they see of the board from where it is on the mean, rms, m.
    fn spread(&self, fitted: &Fitted) -> f64 {
        let used = (0..self.robot.len()).filter(|&i| fitted.is_used(i));
        let places: Vec<Vector3<f64>> = used
            .map(|i| {
                let middle = self.middle(i, fitted.scale);
                let place = self.in_base(fitted, i).0 * middle;
                let place = match self.mount {
                    Mount::Wrist => place,
                    Mount::Fixed => self.robot[i].inverse() * place,
                };
                place - fitted.board * middle
            })
            .collect();
        let n = places.len().max(1) as f64;
        let mean = places.iter().sum::<Vector3<f64>>() / n;
        (places.iter().map(|p| (p - mean).norm_squared()).sum::<f64>() / n).sqrt()
    }

    /// Root mean square distance of the corners from where robot, camera and board put them, px.
    fn rms_px(&self, fitted: &Fitted, views: &[View]) -> f64 {
        let inside = self.inside(&fitted.fit.x);
        let (mut sum, mut n) = (0.0, 0.0);
        for (i, view) in views.iter().enumerate().filter(|(i, _)| fitted.is_used(*i)) {
            let camera_from_board = match self.mount {
                Mount::Wrist => fitted.camera.inverse() * self.robot[i].inverse() * fitted.board,
                Mount::Fixed => fitted.camera.inverse() * self.robot[i] * fitted.board,
            };
            // In the order that the fit took.
            let orders = self.board.orders(&view.points);
            let each = orders.iter().map(|points| {
                let far = points.iter().map(|(point, pixel)| {
                    let p = camera_from_board * Point3::from(point.coords() * fitted.scale);
                    inside.pixel(Vector2::new(p.x / p.z, p.y / p.z)).distance(*pixel).powi(2)
                });
                far.sum::<f64>()
            });
            sum += each.fold(f64::INFINITY, f64::min);
            n += view.points.len() as f64;
        }
        (sum / f64::max(n, 1.0)).sqrt()
    }

    /// Puts together what is known.
    pub(super) fn answer(
        &self,
        views: &[View],
        fitted: &Fitted,
        square: Square,
        motions: Motions,
        other_mount: Option<(f64, f64)>,
    ) -> HandEye {
        let n_used = (0..views.len()).filter(|&i| fitted.is_used(i)).count();
        let view = |(i, view): (usize, &View)| {
            let e: Vector6<f64> = self.residual(fitted, i);
            let is_used = fitted.is_used(i);
            let left_out = if !is_used {
                Some(self.left_out(fitted, i))
            } else if n_used > 3 {
                self.without(fitted, i).ok().map(|others| self.left_out(&others, i))
            } else {
                None
            };
            ViewFit {
                name: view.name.clone(),
                is_used,
                rotation: e.fixed_rows::<3>(0).norm(),
                position: e.fixed_rows::<3>(3).norm(),
                left_out,
                row_of: if is_used { None } else { self.row_of(fitted, i) },
            }
        };
        let placed = |pose, from| Placed {
            pose,
            std_rotation: fitted.std(from),
            std_position: fitted.std(from + 3),
        };
        let corners: f64 = views.iter().map(|v| v.points.len() as f64).sum();
        let squares: f64 = self.sights.iter().map(|s| s.squares).sum();
        HandEye {
            mount: self.mount,
            other_mount,
            camera: placed(fitted.camera, CAMERA),
            board: placed(fitted.board, BOARD),
            intrinsics: self.inside(&fitted.fit.x),
            square,
            noise: fitted.noise,
            rms_px: self.rms_px(fitted, views),
            picture_rms_px: (squares / corners.max(1.0)).sqrt(),
            spread: self.spread(fitted),
            views: views.iter().enumerate().map(view).collect(),
            motions,
        }
    }

    /// The row of the table with which a picture that was left out would agree with the others: one within the cut, or one that
    /// fits by far better than all others, its own among them. Good poses and few pictures put even the right row beyond the
    /// cut, as what the fit itself is off by is no part of the noise.
    fn row_of(&self, fitted: &Fitted, picture: usize) -> Option<usize> {
        let mut fit: Vec<(usize, f64)> =
            (0..self.robot.len()).map(|row| (row, self.length(fitted, picture, row))).collect();
        fit.sort_by(|a, b| a.1.total_cmp(&b.1));
        let (best, next) = (fit.first()?, fit.get(1)?);
        let is_it = best.1 < CUT || FAR * best.1 < next.1;
        (is_it && best.0 != picture).then_some(best.0)
    }
}

impl HandEye {
    /// Returns median, root mean square and the largest of what pictures are predicted to by the others, over those that were
    /// used; positions in m, rotations in rad.
    pub fn leave_one_out(&self) -> Option<(LeftOut, LeftOut, (&ViewFit, LeftOut))> {
        let each: Vec<(&ViewFit, LeftOut)> = self
            .views
            .iter()
            .filter(|v| v.is_used)
            .filter_map(|v| v.left_out.map(|left_out| (v, left_out)))
            .collect();
        let worst = *each.iter().max_by(|a, b| a.1.position.total_cmp(&b.1.position))?;
        let over = |of: &dyn Fn(&LeftOut) -> f64| {
            let mut values: Vec<f64> = each.iter().map(|(_, e)| of(e)).collect();
            let n = values.len() as f64;
            let rms = (values.iter().map(|v| v * v).sum::<f64>() / n).sqrt();
            values.sort_by(f64::total_cmp);
            let middle = values.len() / 2;
            let median = 0.5 * (values[middle] + values[(values.len() - 1) / 2]);
            (median, rms)
        };
        let (position, rotation) = (over(&|e| e.position), over(&|e| e.rotation));
        let median = LeftOut { position: position.0, rotation: rotation.0 };
        Some((median, LeftOut { position: position.1, rotation: rotation.1 }, worst))
    }
}
