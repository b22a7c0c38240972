//! What the edges say of what a placement takes as known: the table's place and the solid's size.
//!
//! A solid of known size on a known plane is over-determined: seen too small it stands lower, farther from
//! the eye, or is smaller than said; a foot that does not lie flat says that the table, or the camera, is
//! tilted. Here the fit of [`super::refine`] is asked what would change were the table's height and tilt, or
//! the size, free as well. The table is the same for all objects, so what they say of it is put together
//! ([`TableDoubt`]); each size is the object's own, and so is whether it stands on the table: what looks larger in all directions
//! alike is nearer to the eye, on something. What is true is not known: four explanations (all as said, table wrong, size wrong,
//! higher than the table) are weighed by their evidence, and a placement is as uncertain as their mixture.
//!
//! Source: `MacKay`, *Information Theory, Inference, and Learning Algorithms*, 2003, ch. 28 (evidence, Occam
//! factors); linear Gaussian throughout, with Tukey weights against edges of other things.

use nalgebra::{Matrix3, SMatrix, SVector, Translation3, UnitQuaternion, Vector3};

use super::evidence::Hidden;
use super::outline::{ObjectPose, Projector};
use super::picture::{Picture, median};
use super::refine::{Edge, INDEPENDENT_PX, look};
use crate::world::{Material, Shape};

/// x, y, yaw; the table's height and its tilt about x and y; the solid's size and its height, relative.
const N: usize = 8;
type Square = SMatrix<f64, N, N>;
type Column = SVector<f64, N>;

/// What nobody knows beforehand, m and rad: where it stands.
const ANYWHERE: f64 = 1.0;
/// How well sizes in a scene are known when they are right, relative.
const SIZE: f64 = 0.01;
/// How far a size is off when it is wrong, relative: of the whole, and of the height alone.
const WRONG_SIZE: [f64; 2] = [0.06, 0.2];
/// How well the table is known when it is right, m and rad: a calibrated camera's pose.
const TABLE: [f64; 2] = [0.001, 0.002];
/// How far it is off when it is wrong, m and rad.
const WRONG_TABLE: [f64; 2] = [0.03, 0.05];
/// How often an object's size, and a scene's table, are wrong, before anything is seen.
const WRONG: [f64; 2] = [0.1, 0.2];
/// How high things stand that stand on others, m, and how often one does that is said to stand on the table. Chosen: as high as things
/// are that others are put on, and as often as a size is wrong.
const RAISED: f64 = 0.1;
const ON_ANOTHER: f64 = 0.1;
/// Probability from which a wrong scene counts at all: what is hardly told from its prior is not evidence.
const COUNTS: f64 = 0.25;
/// How far off an edge may be as a whole, px: rounded rims, shadows at the foot; of a clear thing, its wall.
const EDGE_PX: [f64; 2] = [0.5, 3.0];
/// What no edge point is better than, px.
const FLOOR_PX: f64 = 0.3;
/// How far from the outline edges are looked for, px.
const REACH_PX: f64 = 6.0;
/// Steps of the differences: m, rad, and relative.
const H: f64 = 1e-5;

/// The normal equations of one object's edges in all eight unknowns, at its placement.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Doubt {
    normal: Square,
    rhs: Column,
    /// Share of the visible silhouette, by whole edges, that shows no edge in the picture.
    pub missing: f64,
}

/// The edges explained under one prior.
struct Explanation {
    /// The most probable unknowns.
    state: Column,
    /// Variance of the place, both directions together, m².
    variance: f64,
    /// Logarithm of how well the prior foretold the edges, up to a constant.
    evidence: f64,
}

/// What all objects together say of the table.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TableDoubt {
    /// Height of the table at its centre, m, and tilts about x and y, rad; all 0 if the scene is right.
    pub off: Vector3<f64>,
    /// Its covariance.
    pub covariance: Matrix3<f64>,
    /// Logarithm of how much better a wrong table explains the edges than the one that is said.
    pub evidence: f64,
}

/// What all this means for one object.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Meaning {
    /// How probable it is that the table is not where it is said to be.
    pub table: f64,
    /// How far the object would then be from where it was placed, m.
    pub by_table: f64,
    /// How probable it is that the size is not as said.
    pub size: f64,
    /// How far the object would then be from where it was placed, m.
    pub by_size: f64,
    /// How much larger it would then be, relative: the whole, and its height beyond that.
    pub larger: [f64; 2],
    /// How probable it is that it stands higher than the table.
    pub raised: f64,
    /// How far the object would then be from where it was placed, m.
    pub by_raised: f64,
    /// How much higher, m, and how far along x and y from where it was placed, m.
    pub height: f64,
    /// See [`Self::height`].
    pub shift: [f64; 2],
    /// Height of the table's centre were the table wrong, m.
    pub lift: f64,
    /// Its tilt, rad.
    pub tilt: f64,
}

impl Meaning {
    /// Returns what the scene adds to the placement's standard deviation, m.
    pub fn std(&self) -> f64 {
        let counts = |p: f64| ((p - COUNTS) / (1.0 - COUNTS)).max(0.0);
        let square = |p: f64, by: f64| counts(p) * by * by;
        let by_table = square(self.table, self.by_table);
        (by_table + square(self.size, self.by_size) + square(self.raised, self.by_raised)).sqrt()
    }
}

/// Returns the pose of a standing solid on a table that is lifted and tilted about a pivot.
fn stand([x, y, yaw, lift, tilt_x, tilt_y]: [f64; 6], pivot: [f64; 2]) -> ObjectPose {
    let pivot = Translation3::new(pivot[0], pivot[1], 0.0);
    let tilt = UnitQuaternion::from_scaled_axis(Vector3::new(tilt_x, tilt_y, 0.0));
    let plane = Translation3::new(0.0, 0.0, lift) * pivot * tilt * pivot.inverse();
    ObjectPose::new(plane * ObjectPose::upright(x, y, 0.0, yaw).isometry())
}

/// Returns how an edge's place along its normal changes with each unknown, px/m, px/rad, px.
fn row(edge: &Edge, view: &Projector, pose: &ObjectPose, pivot: [f64; 2]) -> Column {
    let (at, yaw) = (pose.origin(), pose.yaw());
    Column::from_fn(|k, _| {
        let mut state = [at.x, at.y, yaw, 0.0, 0.0, 0.0];
        let mut body = edge.body;
        match k {
            6 => body *= 1.0 + H,
            7 => body.z *= 1.0 + H,
            _ => state[k] += H,
        }
        edge.slope(view, &stand(state, pivot), body) / H
    })
}

/// Returns the precisions of a prior with these deviations.
fn prior(table: [f64; 2], size: [f64; 2]) -> Column {
    let [lift, tilt] = table;
    Column::from([ANYWHERE, ANYWHERE, ANYWHERE, lift, tilt, tilt, size[0], size[1]])
        .map(|std| std.powi(-2))
}

impl Doubt {
    /// Asks the edges near a placement; `None` when they are too few.
    ///
    /// `full` is the gradient, CIELAB/px, at which an edge counts in full; `pivot` the table's centre, m.
    pub fn ask(
        picture: &Picture,
        view: &Projector,
        shape: &Shape,
        pose: &ObjectPose,
        hidden: &Hidden,
        (full, material, pivot): (f64, Material, [f64; 2]),
    ) -> Option<Self> {
        let clear = material == Material::Transparent;
        let seen = look(picture, view, shape, pose, hidden, (full, REACH_PX, clear));
        if seen.edges.len() < 20 {
            return None;
        }
        let shared = EDGE_PX[usize::from(clear)].powi(-2);
        let rows: Vec<Column> = seen.edges.iter().map(|e| row(e, view, pose, pivot)).collect();
        let free = prior(WRONG_TABLE, WRONG_SIZE);
        let mut state = Column::zeros();
        let (mut normal, mut rhs) = (Square::zeros(), Column::zeros());
        for _ in 0..6 {
            // Weights are those of the freest explanation, so that none is blamed for another thing's edge.
            let left = |k: usize| seen.edges[k].offset - rows[k].dot(&state);
            let mut off: Vec<f64> = (0..rows.len()).map(|k| left(k).abs()).collect();
            let spread = (1.4826 * median(&mut off)).max(FLOOR_PX);
            (normal, rhs) = (Square::zeros(), Column::zeros());
            let mut whole = [(Column::zeros(), 0.0, 0.0); 16];
            for (k, (edge, row)) in seen.edges.iter().zip(&rows).enumerate() {
                let t = (left(k) / (4.0 * spread)).powi(2);
                if t < 1.0 {
                    let w = edge.weight * (1.0 - t).powi(2) / (INDEPENDENT_PX * spread * spread);
                    normal += w * row * row.transpose();
                    rhs += w * row * edge.offset;
                    let of = &mut whole[edge.of];
                    *of = (of.0 + w * row, of.1 + w * edge.offset, of.2 + w);
                }
            }
            // Each edge may be off as a whole: that offset is eliminated.
            for (row, offset, weight) in whole {
                let share = 1.0 / (weight + shared);
                normal -= share * row * row.transpose();
                rhs -= share * row * offset;
            }
            let free = normal + Square::from_diagonal(&free);
            state = free.cholesky()?.solve(&rhs);
        }
        Some(Self { normal, rhs, missing: seen.missing })
    }

    /// Returns the information on the table's three numbers, the object's own unknowns eliminated.
    fn on_table(&self) -> Option<(Matrix3<f64>, Vector3<f64>)> {
        // Eight unknowns to three: the covariance's block, inverted, less the prior that was put in.
        let precision = prior([1.0, 1.0], [SIZE; 2]);
        let inverse = (self.normal + Square::from_diagonal(&precision)).try_inverse()?;
        let mean = inverse * self.rhs;
        let information = inverse.fixed_view::<3, 3>(3, 3).try_inverse()?;
        let vector = information * mean.fixed_rows::<3>(3);
        Some((information - Matrix3::identity(), vector))
    }

    /// Returns the same equations about a table that is elsewhere, and what that alone explains.
    fn at(&self, table: &Vector3<f64>) -> (Self, f64) {
        let mut off = Column::zeros();
        off.fixed_rows_mut::<3>(3).copy_from(table);
        let gained = self.rhs.dot(&off) - 0.5 * off.dot(&(self.normal * off));
        (Self { rhs: self.rhs - self.normal * off, ..*self }, gained)
    }

    /// Returns the logarithm of how well a table explains the edges, whether the size is as said or not.
    fn evidence(&self, table: &Vector3<f64>) -> Option<f64> {
        let (there, gained) = self.at(table);
        let right = there.under(&prior(TABLE, [SIZE; 2]))?.evidence;
        let sized = there.under(&prior(TABLE, WRONG_SIZE))?.evidence;
        Some(gained + right + (WRONG[0] * (sized - right).min(50.0).exp()).ln_1p())
    }

    /// Explains the edges under a prior.
    fn under(&self, precision: &Column) -> Option<Explanation> {
        let posterior = (self.normal + Square::from_diagonal(precision)).cholesky()?;
        let state = posterior.solve(&self.rhs);
        let occam = posterior.ln_determinant() - precision.iter().map(|p| p.ln()).sum::<f64>();
        let inverse = posterior.inverse();
        Some(Explanation {
            state,
            variance: inverse[(0, 0)] + inverse[(1, 1)],
            evidence: 0.5 * self.rhs.dot(&state) - 0.5 * occam,
        })
    }

    /// Weighs the explanations for one object, given what all of them say of the table; `height` is the
    /// camera's above it, m.
    pub fn meaning(&self, table: Option<&TableDoubt>, height: f64) -> Meaning {
        self.weigh(table, height).unwrap_or_default()
    }

    fn weigh(&self, table: Option<&TableDoubt>, height: f64) -> Option<Meaning> {
        let right = self.under(&prior(TABLE, [SIZE; 2]))?;
        let sized = self.under(&prior(TABLE, WRONG_SIZE))?;
        let raised = self.under(&prior([RAISED, TABLE[1]], [SIZE; 2]))?;
        let odds = |often: f64, evidence: f64| often * evidence.clamp(-50.0, 50.0).exp();
        let apart = |state: &Column| (state.xy() - right.state.xy()).norm();
        let [by_size, by_raised] = [&sized, &raised].map(|other| {
            apart(&other.state).hypot((other.variance - right.variance).max(0.0).sqrt())
        });
        let gains = [sized.evidence, raised.evidence].map(|evidence| evidence - right.evidence);
        // Beyond what counts in full only which of the two is ahead does.
        let beyond = (gains[0].max(gains[1]) - 50.0).max(0.0);
        let size_odds = odds(WRONG[0], gains[0] - beyond);
        // Nothing stands in the table.
        let raised_odds =
            if raised.state[3] > 0.0 { odds(ON_ANOTHER, gains[1] - beyond) } else { 0.0 };
        let mut meaning = Meaning {
            by_size,
            larger: [sized.state[6], sized.state[7]],
            by_raised,
            height: raised.state[3],
            shift: [raised.state[0], raised.state[1]],
            ..Meaning::default()
        };
        let mut table_odds = 0.0;
        if let Some(table) = table {
            // How the place follows the table with everything else at its best.
            let own = (self.normal + Square::from_diagonal(&prior([1e-6; 2], [SIZE; 2])))
                .try_inverse()?;
            let pull: SMatrix<f64, N, 3> = self.normal.fixed_view::<N, 3>(0, 3).into_owned();
            let follows = -(own * pull).fixed_rows::<2>(0).into_owned();
            let moved = own * (self.rhs - pull * table.off);
            let spread = (follows * table.covariance * follows.transpose()).trace();
            // A camera that is turned by as much as the table seems to be is also mistaken in where it
            // looks, which no object shows.
            let aside = table.off.yz().norm() * height;
            meaning.by_table = (apart(&moved).powi(2) + spread + aside * aside).sqrt();
            meaning.lift = table.off.x;
            meaning.tilt = table.off.yz().norm();
            table_odds = odds(WRONG[1], table.evidence);
        }
        meaning.table = table_odds / (1.0 + table_odds);
        let share = (1.0 - meaning.table) / (1.0 + size_odds + raised_odds);
        (meaning.size, meaning.raised) = (share * size_odds, share * raised_odds);
        Some(meaning)
    }
}

impl TableDoubt {
    /// Returns where the table is if it alone is to blame for what these objects' edges say.
    pub fn to_blame(doubts: &[Doubt]) -> Option<Self> {
        let [lift, tilt] = WRONG_TABLE;
        let precision = Vector3::new(lift, tilt, tilt).map(|s| s.powi(-2));
        let (mut information, mut vector) = (Matrix3::from_diagonal(&precision), Vector3::zeros());
        for (own, told) in doubts.iter().filter_map(Doubt::on_table) {
            information += own;
            vector += told;
        }
        let covariance = information.try_inverse()?;
        Some(Self { off: covariance * vector, covariance, evidence: 0.0 })
    }

    /// Puts together what objects say of the table they stand on; `None` of none.
    ///
    /// One of them may be of another size than said and mislead the rest, so what all say and what each says
    /// by itself are tried, lifted only or tilted too, and the best explanation of all edges is kept.
    pub fn of(doubts: &[Doubt]) -> Option<Self> {
        let told: Vec<_> = doubts.iter().filter_map(Doubt::on_table).collect();
        let all =
            |table: &Vector3<f64>| doubts.iter().map(|d| d.evidence(table)).sum::<Option<f64>>();
        let as_said = all(&Vector3::zeros())?;
        let mut groups: Vec<(Matrix3<f64>, Vector3<f64>)> = told.clone();
        groups.push(
            told.iter()
                .fold((Matrix3::zeros(), Vector3::zeros()), |sum, t| (sum.0 + t.0, sum.1 + t.1)),
        );
        let mut best: Option<Self> = None;
        for (information, vector) in groups {
            for [lift, tilt] in [[WRONG_TABLE[0], TABLE[1]], WRONG_TABLE] {
                let precision = Vector3::new(lift, tilt, tilt).map(|s| s.powi(-2));
                let posterior = (information + Matrix3::from_diagonal(&precision)).cholesky()?;
                let off = posterior.solve(&vector);
                let occam = posterior.ln_determinant() - precision.map(f64::ln).sum();
                let strained = off.component_mul(&precision).dot(&off);
                let evidence = all(&off)? - as_said - 0.5 * (strained + occam);
                if best.is_none_or(|b| evidence > b.evidence) {
                    best = Some(Self { off, covariance: posterior.inverse(), evidence });
                }
            }
        }
        best
    }
}
