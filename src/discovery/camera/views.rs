//! Points laid out for fitting: whose pose is known, which move and how, which are held out; and the residuals of a
//! bent camera on them.

use std::collections::BTreeMap;

use nalgebra::{
    Isometry3, Matrix2x3, Matrix6, Translation3, UnitQuaternion, Vector2, Vector3, Vector6,
};

use super::bent::Bent;
use super::lens::Lens;
use crate::discovery::resample::is_unseen_alone;
use crate::discovery::robot::spline::Spline;
use crate::discovery::selection::Set;

/// A point is on the table when it is nearer to the plane z = 0 than this, m.
const ON_TABLE: f64 = 1e-6;

/// How a point moves.
#[derive(Debug, Clone, PartialEq)]
pub struct Track {
    /// Its place over time, an axis each.
    pub axes: [Spline; 3],
}

impl Track {
    /// `sample` is where to look first.
    fn at(&self, time: f64, sample: usize) -> Vector3<f64> {
        let value = |axis: &Spline| axis.at(time, &mut { sample }).0;
        Vector3::new(value(&self.axes[0]), value(&self.axes[1]), value(&self.axes[2]))
    }

    fn velocity(&self, time: f64, sample: usize) -> Vector3<f64> {
        let slope = |axis: &Spline| axis.at(time, &mut { sample }).1;
        Vector3::new(slope(&self.axes[0]), slope(&self.axes[1]), slope(&self.axes[2]))
    }
}

/// One point in one picture.
#[derive(Debug, Clone, PartialEq)]
pub struct Sight {
    /// Index of the file.
    pub file: usize,
    /// Line of its file.
    pub line: usize,
    /// Index into [`Data::views`].
    pub view: usize,
    /// Where the point is, m.
    pub point: Vector3<f64>,
    /// Where it is seen, px.
    pub pixel: Vector2<f64>,
    /// When, s; 0 where no time is given.
    pub time: f64,
    /// Index into [`Data::tracks`], if it moves.
    pub track: Option<usize>,
    /// Which sample of its track it is.
    pub sample: usize,
    /// Which data it belongs to.
    pub set: Set,
    /// Whether it was left out as a wrong match.
    pub wrong: bool,
}

/// A picture.
#[derive(Debug, Clone, PartialEq)]
pub struct View {
    /// Its name.
    pub name: String,
    /// The camera's axes from the world's, as known or as a first guess.
    pub camera_from_world: Isometry3<f64>,
}

/// Points, pictures, and the camera as the model has it.
#[derive(Debug, Clone, PartialEq)]
pub struct Data {
    /// The nominal lens.
    pub lens: Lens,
    /// The points, in order.
    pub sights: Vec<Sight>,
    /// The pictures.
    pub views: Vec<View>,
    /// Whether the poses of the views are known; else they are fitted to every hypothesis.
    pub posed: bool,
    /// The world's z in the camera's axes, where one pose is that of all views.
    pub vertical: Option<Vector3<f64>>,
    /// Points that move.
    pub tracks: Vec<Track>,
    /// Whether the points have times.
    pub timed: bool,
    /// Standard deviation of a pixel coordinate, px.
    pub sigma: f64,
    /// Whether that was given.
    pub sigma_given: bool,
    /// Largest normalised coordinate.
    pub extent: f64,
}

impl Sight {
    /// Returns whether the table carries it.
    pub fn on_table(&self) -> bool {
        self.point.z.abs() < ON_TABLE
    }
}

/// Returns the rigid motion of a turn (rad) and a shift (m).
pub(super) fn nudge(step: &[f64]) -> Isometry3<f64> {
    let turned = UnitQuaternion::from_scaled_axis(Vector3::new(step[0], step[1], step[2]));
    Isometry3::from_parts(Translation3::new(step[3], step[4], step[5]), turned)
}

impl Data {
    /// Returns the sights of a set that are no wrong matches, picture by picture.
    pub fn groups(&self, set: Set) -> Vec<(usize, Vec<usize>)> {
        let mut groups: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
        for (at, sight) in self.sights.iter().enumerate() {
            if sight.set == set && !sight.wrong {
                groups.entry(sight.view).or_default().push(at);
            }
        }
        groups.into_iter().collect()
    }

    /// Returns how many sights of a set are used.
    pub fn used(&self, set: Set) -> usize {
        self.sights.iter().filter(|sight| sight.set == set && !sight.wrong).count()
    }

    /// Returns how many independent residuals a set has: two a point, less what the poses take.
    pub fn count(&self, set: Set) -> usize {
        let poses = if self.posed { 0 } else { self.groups(set).len() };
        (2 * self.used(set)).saturating_sub(6 * poses)
    }

    /// Returns the world's z in the axes of the camera; z of the camera where there is no one pose.
    pub fn up(&self) -> Vector3<f64> {
        self.vertical.unwrap_or_else(Vector3::z)
    }

    /// Returns where a point is when its row of the picture is taken.
    pub fn place(&self, bent: &Bent, sight: &Sight) -> Vector3<f64> {
        let late = bent.row_time * sight.pixel.y - bent.delay;
        let point = match sight.track {
            Some(track) if late.abs() > 0.0 => {
                self.tracks[track].at(sight.time + late, sight.sample)
            }
            _ => sight.point,
        };
        bent.carried(point, sight.on_table())
    }

    /// Returns the pixel of a sight through a bent camera; `None` behind it.
    pub fn pixel(&self, bent: &Bent, pose: &Isometry3<f64>, sight: &Sight) -> Option<Vector2<f64>> {
        let point = self.place(bent, sight);
        bent.pixel(pose.transform_point(&point.into()).coords, sight.time)
    }

    /// Returns how fast a sight's pixel moves, px/s; 0 for a point that stands.
    pub fn speed(&self, bent: &Bent, sight: &Sight) -> Vector2<f64> {
        // Of the difference quotient, s: points swing within seconds.
        const SHORT: f64 = 1e-4;
        let Some(track) = sight.track else { return Vector2::zeros() };
        let pose = &self.views[sight.view].camera_from_world;
        let step = self.tracks[track].velocity(sight.time, sight.sample) * SHORT;
        let at = |by: f64| {
            let c = pose.transform_point(&(sight.point + step * by).into());
            bent.pixel(c.coords, sight.time)
        };
        match (at(1.0), at(-1.0)) {
            (Some(after), Some(before)) => (after - before) / (2.0 * SHORT),
            _ => Vector2::zeros(),
        }
    }

    /// Returns measured minus model (px) of every sight used of a set, in the order of [`Self::groups`], and which
    /// sight each is; `None` when a point comes to lie behind the camera.
    pub fn residuals(&self, bent: &Bent, set: Set) -> Option<Vec<(usize, Vector2<f64>)>> {
        let mut found = Vec::new();
        for (view, sights) in self.groups(set) {
            let mut pose = self.views[view].camera_from_world;
            if !self.posed {
                pose = self.best_pose(bent, pose, &sights)?;
            }
            for at in sights {
                let sight = &self.sights[at];
                found.push((at, sight.pixel - self.pixel(bent, &pose, sight)?));
            }
        }
        Some(found)
    }

    /// Returns the pose that brings a picture's points closest to where they are seen, by Gauss and Newton.
    ///
    /// It is fitted to rounding, so that differences between two bent cameras are those of the cameras.
    fn best_pose(
        &self,
        bent: &Bent,
        start: Isometry3<f64>,
        sights: &[usize],
    ) -> Option<Isometry3<f64>> {
        // Many more than quadratic convergence takes; the difference quotient steps by a millionth of the depth.
        const STEPS: usize = 30;
        const SHORT: f64 = 1e-6;
        let mut pose = start;
        let mut before = f64::INFINITY;
        for _ in 0..STEPS {
            let (mut a, mut g) = (Matrix6::<f64>::zeros(), Vector6::<f64>::zeros());
            let mut cost = 0.0;
            for &at in sights {
                let sight = &self.sights[at];
                let c = pose.transform_point(&self.place(bent, sight).into()).coords;
                let here = bent.pixel(c, sight.time)?;
                let left = sight.pixel - here;
                cost += left.norm_squared();
                let mut by_point = Matrix2x3::zeros();
                for axis in 0..3 {
                    let mut moved = c;
                    moved[axis] += SHORT * c.z;
                    by_point.set_column(
                        axis,
                        &((bent.pixel(moved, sight.time)? - here) / (SHORT * c.z)),
                    );
                }
                let by_turn = -by_point * c.cross_matrix();
                let mut j = nalgebra::Matrix2x6::zeros();
                j.fixed_columns_mut::<3>(0).copy_from(&by_turn);
                j.fixed_columns_mut::<3>(3).copy_from(&by_point);
                a += j.transpose() * j;
                g += j.transpose() * left;
            }
            let step = a.cholesky()?.solve(&g);
            pose = nudge(step.as_slice()) * pose;
            let done = step.norm() < 1e-9 || (before - cost).abs() <= 1e-13 * cost;
            before = cost;
            if done {
                break;
            }
        }
        Some(pose)
    }

    /// Sets a part of the sights held out aside, which decide nothing: where each picture's pose is fitted, only as many as
    /// leave it known by the others and by themselves.
    pub fn set_aside(&mut self, least_in_view: usize) {
        let all = || self.groups(Set::Heldout).into_iter().map(|(_, sights)| sights);
        let lists: Vec<Vec<usize>> = if self.posed {
            vec![all().flatten().collect()]
        } else {
            all().filter(|sights| sights.len() >= 3 * least_in_view).collect()
        };
        for sights in lists {
            for (_, at) in sights.into_iter().enumerate().filter(|(k, _)| is_unseen_alone(*k)) {
                self.sights[at].set = Set::Unseen;
            }
        }
    }

    /// Returns the data with everything in the set that is fitted.
    #[must_use]
    pub fn all_fitted(&self) -> Self {
        let mut all = self.clone();
        for sight in &mut all.sights {
            sight.set = Set::Train;
        }
        all
    }
}
