//! Which of the three forms: by evidence, on the rows that the most general form agrees with.
//!
//! Evidence is `-BIC/2`, the log-likelihood less `½ k ln n`, an approximation of the log marginal
//! likelihood up to a constant that is the same for all forms. A form without a single redundant pair
//! cannot be tested and is not chosen; nor is one that predicts left-out rows worse than a simpler one.

use super::super::Error;
pub(super) use super::compared::Compared;
use super::fit::{describe, fit_one};
use super::model::{MapFit, Model, Options, Pair};
use super::pairs::{FLOOR_PX, Map, Pairs};
use super::wording;

/// Fits every form that the rows determine.
pub(super) fn compare(pairs: &[Pair], rows: &[usize], options: &Options) -> Vec<Compared> {
    let kept: Vec<Pair> = rows.iter().map(|&i| pairs[i]).collect();
    let all: Vec<usize> = (0..kept.len()).collect();
    let mut compared = Vec::new();
    for model in Model::FORMS {
        if kept.len() < model.minimal()
            || super::normalise::check_spread(&kept, &all, model).is_err()
        {
            continue;
        }
        let Ok(map) = Pairs::new(&kept, model, options.noise).fit(&all) else { continue };
        let Ok(fit) = describe(&kept, &map, &all, Vec::new(), String::new()) else { continue };
        compared.push(entry(&map, &fit, kept.len()));
    }
    compared
}

/// The line of the comparison about one fit to `n_kept` pairs.
pub(super) fn entry(map: &Map, fit: &MapFit, n_kept: usize) -> Compared {
    let n = 2.0 * n_kept as f64;
    let sigma2 = (map.sum / n).max(FLOOR_PX * FLOOR_PX);
    let log_likelihood = -0.5 * (n * (std::f64::consts::TAU * sigma2).ln() + map.sum / sigma2);
    let evidence = log_likelihood - 0.5 * map.model.dof() as f64 * n.ln();
    let leave_one_out_px = map.leave_one_out_px;
    Compared { model: map.model, mse_px: fit.mse_px, leave_one_out_px, evidence }
}

/// Chooses the form, then fits it to all rows.
pub(super) fn choose(
    pairs: &[Pair],
    scores: Option<&[f64]>,
    options: &Options,
) -> Result<MapFit, Error> {
    // The most general form that the rows determine says which of them belong: what does not fit it
    // does not fit the others.
    let mut kept = None;
    let mut first_error = None;
    for model in Model::FORMS.into_iter().rev() {
        match fit_one(pairs, scores, model, options) {
            Ok((_, rows)) => {
                kept = Some(rows);
                break;
            }
            Err(error) => first_error = first_error.or(Some(error)),
        }
    }
    let Some(rows) = kept else {
        return Err(first_error.unwrap_or(Error::TooFew {
            what: "auto",
            of: "pairs",
            needed: 1,
            given: pairs.len(),
        }));
    };
    let compared = compare(pairs, &rows, options);
    let mut best: Option<&Compared> = None;
    for candidate in &compared {
        // The simplest form is the fallback even when nothing can be tested.
        let Some(now) = best else {
            best = Some(candidate);
            continue;
        };
        let testable = rows.len() > candidate.model.minimal();
        let predicts = match (candidate.leave_one_out_px, now.leave_one_out_px) {
            (Some(c), Some(n)) => c <= n,
            (candidate, now) => candidate.is_some() || now.is_none(),
        };
        if testable && predicts && candidate.evidence > now.evidence {
            best = Some(candidate);
        }
    }
    let Some(best) = best else {
        return Err(first_error.unwrap_or(Error::Degenerate { model: "auto", free: 1 }));
    };
    let model = best.model;
    let reason = reason(&compared, best, rows.len());
    let (map, inliers) = if model == Model::Projective {
        let map = Pairs::new(pairs, model, options.noise).fit(&rows)?;
        (map, rows)
    } else {
        fit_one(pairs, scores, model, options)?
    };
    describe(pairs, &map, &inliers, compared, reason)
}

fn reason(compared: &[Compared], best: &Compared, n: usize) -> String {
    let runner_up = compared
        .iter()
        .filter(|c| c.model != best.model)
        .max_by(|a, b| a.evidence.total_cmp(&b.evidence));
    let name = best.model.name();
    match runner_up {
        None => wording::only_form(name, n),
        Some(other) if other.evidence > best.evidence => {
            wording::cannot_be_tested(name, other.model.name(), n)
        }
        Some(other) => wording::more_evidence(best, other),
    }
}
