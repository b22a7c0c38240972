//! How the forms of the map compare.

use super::Model;

/// One form in the comparison, on the rows kept by the form that was chosen.
#[derive(Debug, Clone, PartialEq)]
pub struct Compared {
    /// The form.
    pub model: Model,
    /// Mean square error in the real picture, px².
    pub mse_px: f64,
    /// Root mean square error of rows predicted from the others, px; `None` without redundancy.
    pub leave_one_out_px: Option<f64>,
    /// `-BIC/2`; more is better.
    pub evidence: f64,
}
