//! Regression 3: the offset `D` with `p̃_s = D p̃_r` (Eq. 7), from where things should be to what the arm
//! (or the twin) must be told.
//!
//! `p_s` is where the robot said or the twin thought it was, `p_r` where it should have been. A command for
//! the real place `p` is `D p`; where the arm really is when it reports `p` is `D⁻¹ p`. [`fit_offset`] takes
//! pairs of points; what is fitted from the pixels at which a camera saw the arm needs the arm's model, and is
//! `execution::calibrate`'s.
//!
//! Points on one plane (the table) leave part of an affine `D` free. Such directions keep the value of "no
//! offset", held there by a weak prior about the identity, and are named.
//!
//! Source: the paper's section 2.2; Umeyama, "Least-Squares Estimation of Transformation Parameters",
//! PAMI 1991 (starting values).

mod models;
mod trust;

use nalgebra::{DMatrix, Matrix4, Vector3, Vector4};

use super::Error;
use super::consensus;
use models::Pairs;
pub use trust::{Known, Trust};

/// What was said and what should have been, m, in the same frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pair {
    /// Where the twin or the robot said (`p_s`).
    pub said: Vector3<f64>,
    /// Where it should be (`p_r`).
    pub real: Vector3<f64>,
}

/// Which form `D` takes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Model {
    /// A shift: 3 degrees of freedom.
    Translation,
    /// A shift and a turn: 6.
    Rigid,
    /// And a scale: 7.
    Similarity,
    /// Any affine map: 12.
    Affine,
    /// Any projective map, the full 4 × 4 matrix of Eq. 7 up to scale: 15.
    Full,
    /// The one with the most evidence.
    Auto,
}

impl Model {
    /// The forms, simplest first.
    pub const FORMS: [Self; 5] =
        [Self::Translation, Self::Rigid, Self::Similarity, Self::Affine, Self::Full];

    /// Returns its name as on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Translation => "translation",
            Self::Rigid => "rigid",
            Self::Similarity => "similarity",
            Self::Affine => "affine",
            Self::Full => "full",
            Self::Auto => "auto",
        }
    }

    /// Returns the model of that name.
    pub fn from_name(name: &str) -> Option<Self> {
        let all = Self::FORMS.into_iter().chain([Self::Auto]);
        all.into_iter().find(|model| model.name() == name)
    }

    /// Returns its degrees of freedom (0 for `Auto`).
    pub fn dof(self) -> usize {
        match self {
            Self::Translation => 3,
            Self::Rigid => 6,
            Self::Similarity => 7,
            Self::Affine => 12,
            Self::Full => 15,
            Self::Auto => 0,
        }
    }

    /// Returns how many pairs determine it.
    pub fn minimal(self) -> usize {
        match self {
            Self::Translation | Self::Auto => 1,
            Self::Rigid | Self::Similarity => 3,
            Self::Affine => 4,
            Self::Full => 5,
        }
    }
}

/// How to fit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// Whether rows may be outliers.
    pub robust: bool,
    /// Standard deviation of every entry of `D`'s linear part about the identity, before measuring; it
    /// decides only what the points leave free. Robots are not 5 % too long.
    pub shrink: f64,
    /// Seed of the sample search.
    pub seed: u64,
}

impl Default for Options {
    fn default() -> Self {
        Self { robust: true, shrink: 0.05, seed: 0 }
    }
}

/// One form in the comparison, on the rows kept by the form that was chosen.
#[derive(Debug, Clone, PartialEq)]
pub struct Compared {
    /// The form.
    pub model: Model,
    /// Root mean square error, m.
    pub rms_m: f64,
    /// Root mean square error of rows predicted from the others, m; `None` without redundancy.
    pub leave_one_out_m: Option<f64>,
    /// `-BIC/2`; more is better.
    pub evidence: f64,
}

/// The offset and what is known about it. Errors are distances `‖p_s - D p_r‖` over the rows kept.
#[derive(Debug, Clone, PartialEq)]
pub struct OffsetFit {
    /// The form, never [`Model::Auto`].
    pub model: Model,
    /// `D`, said from real, with a 1 in its corner.
    pub d: Matrix4<f64>,
    /// Root mean square error, m.
    pub rms_m: f64,
    /// Standard deviation of the noise of one coordinate, m; 0 without redundancy.
    pub noise_m: f64,
    /// Root mean square error of rows predicted from the others, m; `None` without redundancy.
    pub leave_one_out_m: Option<f64>,
    /// The row predicted worst from the others, and by how much, m.
    pub worst: Option<(usize, f64)>,
    /// How many rows it rests on.
    pub kept: usize,
    /// Rows left out, in order.
    pub outliers: Vec<usize>,
    /// What the points leave free, in words; it keeps the value of "no offset".
    pub unobservable: Vec<String>,
    /// Covariance of `D p_r` at the centre of the points, m².
    pub covariance_at_centre: DMatrix<f64>,
    /// What says how far the offset is known elsewhere.
    pub trust: Trust,
    /// The forms side by side on the same rows, simplest first.
    pub compared: Vec<Compared>,
    /// With [`Model::Auto`], a form well ahead in evidence that so few pairs hardly test, so that it was not chosen.
    pub untested: Option<Model>,
}

impl OffsetFit {
    /// Returns what to say so that the arm comes to the real point, m; `None` beyond the map's horizon.
    pub fn apply(&self, real: Vector3<f64>) -> Option<Vector3<f64>> {
        apply(&self.d, real)
    }

    /// Returns whether `D` turns a right hand into a left one, as no arm does: its Jacobian's determinant, `det D / w⁴`, is
    /// negative.
    pub fn is_mirrored(&self) -> bool {
        self.d.determinant() < 0.0
    }

    /// Returns `D⁻¹`, real from said.
    ///
    /// # Errors
    ///
    /// [`Error::Singular`].
    pub fn inverse(&self) -> Result<Matrix4<f64>, Error> {
        let inverse = self.d.try_inverse().ok_or(Error::Singular)?;
        let corner = inverse[(3, 3)];
        if corner.abs() <= 1e-12 * inverse.amax() {
            return Err(Error::Singular);
        }
        Ok(inverse / corner)
    }
}

/// Returns the image of a point under a 4 × 4 map, `None` beyond its horizon.
pub fn apply(d: &Matrix4<f64>, point: Vector3<f64>) -> Option<Vector3<f64>> {
    let p = d * Vector4::new(point.x, point.y, point.z, 1.0);
    (p.w > 1e-9).then(|| p.xyz() / p.w)
}

/// Points closer together than this say nothing about a turn: half a millimetre of noise would be 3°.
const LEAST_SPREAD: f64 = 0.01;

/// Finds the offset from pairs of points.
///
/// # Errors
///
/// [`Error::TooFew`], [`Error::NotFinite`], [`Error::Coincident`] when a turn is asked of points that lie
/// within a centimetre, [`Error::NoConsensus`], [`Error::Singular`].
pub fn fit_offset(pairs: &[Pair], model: Model, options: &Options) -> Result<OffsetFit, Error> {
    for (row, p) in pairs.iter().enumerate() {
        if !p.said.iter().chain(p.real.iter()).all(|v| v.is_finite()) {
            return Err(Error::NotFinite { what: "the pairs", row });
        }
    }
    let is_auto = model == Model::Auto;
    let (model, rows) =
        if is_auto { choose(pairs, options)? } else { (model, agreeing(pairs, model, options)?) };
    let fitted = Pairs::new(pairs, model, options.shrink).fit(&rows)?;
    let compared = compare(pairs, &rows, options);
    let untested = if is_auto { untested(&compared, model, rows.len()) } else { None };
    let outliers = (0..pairs.len()).filter(|i| rows.binary_search(i).is_err()).collect();
    Ok(OffsetFit {
        model,
        d: fitted.d,
        rms_m: fitted.rms,
        noise_m: fitted.noise,
        leave_one_out_m: fitted.leave_one_out,
        worst: fitted.worst,
        kept: rows.len(),
        outliers,
        unobservable: fitted.unobservable,
        covariance_at_centre: fitted.covariance_at_centre,
        trust: fitted.trust,
        compared,
        untested,
    })
}

/// The rows that agree with one form.
fn agreeing(pairs: &[Pair], model: Model, options: &Options) -> Result<Vec<usize>, Error> {
    let needed = model.minimal();
    let given = pairs.len();
    if given < needed {
        return Err(Error::TooFew { what: model.name(), of: "pairs", needed, given });
    }
    let data = Pairs::new(pairs, model, options.shrink);
    if model != Model::Translation && data.spread() < LEAST_SPREAD {
        let spread = data.spread();
        return Err(Error::Coincident { what: "real points", spread, unit: "m" });
    }
    // With one spare row the outlier could be any of them.
    if !options.robust || given < needed + 2 {
        return Ok((0..given).collect());
    }
    let of = "pairs";
    let none = Error::NoConsensus { model: model.name(), agreeing: 0, given, of };
    let found = consensus::search(&data, None, options.seed).ok_or(none)?;
    if found.inliers.len() < needed {
        let agreeing = found.inliers.len();
        return Err(Error::NoConsensus { model: model.name(), agreeing, given, of });
    }
    Ok(found.inliers)
}

/// Below this, points are measured better than any touch-off; exact data would have infinite evidence.
const FLOOR_M: f64 = 1e-6;

fn compare(pairs: &[Pair], rows: &[usize], options: &Options) -> Vec<Compared> {
    let mut compared = Vec::new();
    for model in Model::FORMS {
        if rows.len() < model.minimal() {
            continue;
        }
        let Ok(fitted) = Pairs::new(pairs, model, options.shrink).fit(rows) else { continue };
        let n = 3.0 * rows.len() as f64;
        let sum = fitted.rms * fitted.rms * rows.len() as f64;
        let sigma2 = (sum / n).max(FLOOR_M * FLOOR_M);
        let log_likelihood = -0.5 * (n * (std::f64::consts::TAU * sigma2).ln() + sum / sigma2);
        // A direction that the points leave free costs nothing and explains nothing.
        let dof = (model.dof() - fitted.n_free) as f64;
        compared.push(Compared {
            model,
            rms_m: fitted.rms,
            leave_one_out_m: fitted.leave_one_out,
            evidence: log_likelihood - 0.5 * dof * n.ln(),
        });
    }
    compared
}

/// What a form without a pair to spare must be ahead by: of three pairs a rigid form leaves three equations to spare, their distances,
/// but what is left of three says little. Twice the logarithm of a Bayes factor above 10 is very strong (Kass and Raftery, "Bayes
/// factors", JASA 1995, §3.2).
const VERY_STRONG: f64 = 5.0;
/// And what it is told from, where it is not chosen: strong (above 6 there).
const STRONG: f64 = 3.0;

/// Returns by how much a form must be ahead to be chosen for so many pairs; `None` where nothing tests it.
fn needed_lead(model: Model, n_pairs: usize) -> Option<f64> {
    // As many equations to spare as a pair has.
    let is_told = 3 * n_pairs >= model.dof() + 3;
    is_told.then_some(if n_pairs > model.minimal() { 0.0 } else { VERY_STRONG })
}

/// The form with the most evidence of those that have no pair to spare but equations, where it is well ahead of the chosen one.
fn untested(compared: &[Compared], chosen: Model, n_pairs: usize) -> Option<Model> {
    let least = compared.iter().find(|c| c.model == chosen)?.evidence;
    let hardly = |c: &&Compared| needed_lead(c.model, n_pairs).is_some_and(|lead| lead > 0.0);
    let ahead = compared.iter().filter(hardly).filter(|c| c.evidence > least + STRONG);
    ahead.max_by(|a, b| a.evidence.total_cmp(&b.evidence)).map(|c| c.model)
}

/// The form with the most evidence that also predicts left-out rows best, and the rows it keeps.
fn choose(pairs: &[Pair], options: &Options) -> Result<(Model, Vec<usize>), Error> {
    // Rigid is what an arm's base or tool error is; more general forms follow outliers more easily.
    let rows = agreeing(pairs, Model::Rigid, options)
        .or_else(|error| agreeing(pairs, Model::Translation, options).map_err(|_| error))?;
    let compared = compare(pairs, &rows, options);
    let mut best: Option<&Compared> = None;
    for candidate in &compared {
        let better = best.is_none_or(|now| {
            let predicts = match (candidate.leave_one_out_m, now.leave_one_out_m) {
                (Some(c), Some(n)) => c < n,
                (candidate, now) => candidate.is_some() || now.is_none(),
            };
            let lead = needed_lead(candidate.model, rows.len());
            predicts && lead.is_some_and(|lead| candidate.evidence > now.evidence + lead)
        });
        if better {
            best = Some(candidate);
        }
    }
    let model = best.map_or(Model::Translation, |c| c.model);
    // A more general form may take rows back that the rigid one could not explain.
    let rows =
        if model.dof() > Model::Rigid.dof() { agreeing(pairs, model, options)? } else { rows };
    Ok((model, rows))
}
