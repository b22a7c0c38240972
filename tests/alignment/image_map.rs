//! Regression 1: planted maps with noise and outliers, degenerate input, the graffiti pair.

use nalgebra::{DMatrix, DVector, Matrix3};
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};
use trueup::alignment::Error;
use trueup::alignment::image_map::{
    Model, NoiseIn, Options, Pair, apply, compare, fit_map, invert,
};
use trueup::world::Pixel;

use super::support::{normal, numbers};
use crate::absent::public;

const TRUTH: [f64; 9] = [0.92, -0.08, 60.0, 0.11, 0.95, -35.0, 1.5e-4, -9e-5, 1.0];

fn truth() -> Matrix3<f64> {
    Matrix3::from_row_slice(&TRUTH)
}

/// Pairs under `m` in a 1000 × 800 picture: every row with noise of `sigma` px in the real picture, the
/// first `outliers` of every ten anywhere. Returns which rows are outliers too.
fn planted(
    m: &Matrix3<f64>,
    n: usize,
    sigma: f64,
    outliers: usize,
    seed: u64,
) -> (Vec<Pair>, Vec<bool>) {
    let mut random = StdRng::seed_from_u64(seed);
    let mut wrong = Vec::new();
    let pairs = (0..n)
        .map(|i| {
            let twin =
                Pixel::new(random.random_range(0.0..1000.0), random.random_range(0.0..800.0));
            let mut real = apply(m, twin).unwrap();
            real.u += sigma * normal(&mut random);
            real.v += sigma * normal(&mut random);
            wrong.push(i % 10 < outliers);
            if i % 10 < outliers {
                real =
                    Pixel::new(random.random_range(0.0..1000.0), random.random_range(0.0..800.0));
            }
            Pair { real, twin }
        })
        .collect();
    (pairs, wrong)
}

/// Root mean square distance between two maps over a 9 × 9 grid of the picture.
fn grid_rms(a: &Matrix3<f64>, b: &Matrix3<f64>, width: f64, height: f64) -> f64 {
    let mut sum = 0.0;
    for i in 0..9 {
        for j in 0..9 {
            let p = Pixel::new(width * f64::from(i) / 8.0, height * f64::from(j) / 8.0);
            let distance = apply(a, p).unwrap().distance(apply(b, p).unwrap());
            sum += distance * distance;
        }
    }
    (sum / 81.0).sqrt()
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// Median error of the robust fit over the median error of least squares on the true inliers.
fn against_the_floor(n: usize, trials: u64) -> (f64, f64, f64) {
    let options = Options { noise: NoiseIn::Real, ..Options::default() };
    let plain = Options { robust: false, ..options };
    let (mut ours, mut floor, mut worst) = (Vec::new(), Vec::new(), 0.0_f64);
    for seed in 0..trials {
        let (pairs, wrong) = planted(&truth(), n, 0.5, 3, seed);
        let fit = fit_map(&pairs, Model::Projective, &options).unwrap();
        let clean: Vec<Pair> =
            pairs.iter().zip(&wrong).filter(|(_, w)| !**w).map(|(p, _)| *p).collect();
        let best = fit_map(&clean, Model::Projective, &plain).unwrap();
        ours.push(grid_rms(&fit.m, &truth(), 1000.0, 800.0));
        let bound = grid_rms(&best.m, &truth(), 1000.0, 800.0);
        worst = worst.max(ours[ours.len() - 1] / bound);
        floor.push(bound);
    }
    (median(ours), median(floor), worst)
}

#[test]
fn twenty_pairs_with_six_outliers_come_within_five_percent_of_the_floor() {
    let (ours, floor, worst) = against_the_floor(20, 200);
    assert!(ours <= 1.05 * floor, "{ours} against {floor}");
    // No failure in 200: a wrong map would be off by tens of pixels.
    assert!(worst < 6.0, "worst ratio {worst}");
}

#[test]
fn a_thousand_pairs_come_within_five_percent_of_the_floor() {
    let (ours, floor, worst) = against_the_floor(1000, 40);
    assert!(ours <= 1.05 * floor, "{ours} against {floor}");
    assert!(worst < 2.0, "worst ratio {worst}");
}

#[test]
fn a_hundred_thousand_pairs_come_within_five_percent_of_the_floor() {
    let (ours, floor, _) = against_the_floor(100_000, 3);
    assert!(ours <= 1.05 * floor, "{ours} against {floor}");
}

#[test]
fn exact_pairs_give_the_exact_map_and_its_inverse_undoes_it() {
    let (pairs, _) = planted(&truth(), 12, 0.0, 0, 1);
    let fit = fit_map(&pairs, Model::Projective, &Options::default()).unwrap();
    assert!((fit.m - truth()).amax() < 1e-9, "{}", fit.m);
    assert!(fit.outliers.is_empty() && fit.rms_px < 1e-8);
    let back = invert(&fit.m).unwrap();
    for pair in &pairs {
        assert!(apply(&back, pair.real).unwrap().distance(pair.twin) < 1e-6);
    }
}

#[test]
fn the_order_of_rows_does_not_matter() {
    let (pairs, _) = planted(&truth(), 60, 0.5, 3, 5);
    let turned: Vec<Pair> = (0..60).map(|i| pairs[(i * 17 + 5) % 60]).collect();
    let a = fit_map(&pairs, Model::Auto, &Options::default()).unwrap();
    let b = fit_map(&turned, Model::Auto, &Options::default()).unwrap();
    assert!((a.m - b.m).amax() < 1e-9 * a.m.amax());
    let mut rows: Vec<usize> = b.outliers.iter().map(|i| (i * 17 + 5) % 60).collect();
    rows.sort_unstable();
    assert_eq!(rows, a.outliers);
}

#[test]
fn planted_outliers_are_the_rows_named() {
    let (pairs, wrong) = planted(&truth(), 40, 0.4, 2, 9);
    let fit = fit_map(&pairs, Model::Projective, &Options::default()).unwrap();
    let planted: Vec<usize> = (0..40).filter(|&i| wrong[i]).collect();
    assert_eq!(fit.outliers, planted);
    // sqrt(2) coordinates of 0.4 px, less what eight parameters absorb.
    assert!((fit.noise_px * (2.0_f64).sqrt() - 0.4).abs() < 0.15, "{}", fit.noise_px);
}

#[test]
fn auto_picks_the_form_that_made_the_data() {
    let scale = Matrix3::from_diagonal(&nalgebra::Vector3::new(1.1, 0.9, 1.0));
    let affine = Matrix3::new(0.95, 0.12, 14.0, -0.1, 1.04, -8.0, 0.0, 0.0, 1.0);
    for (m, expected) in
        [(scale, Model::Scale), (affine, Model::Affine), (truth(), Model::Projective)]
    {
        let right = (0..20)
            .filter(|&seed| {
                let (pairs, _) = planted(&m, 30, 0.5, 1, 100 + seed);
                let fit = fit_map(&pairs, Model::Auto, &Options::default()).unwrap();
                assert_eq!(fit.compared.len(), 3);
                fit.model == expected
            })
            .count();
        // BIC at 54 numbers keeps a needless pair of parameters in about one case of fifty.
        assert!(right >= 18, "{expected:?} found in {right} of 20");
    }
}

#[test]
fn the_covariance_is_what_repetition_shows() {
    let options = Options { robust: false, noise: NoiseIn::Real, seed: 0 };
    let runs = 400;
    let (mut all, mut told) = (Vec::new(), DMatrix::<f64>::zeros(8, 8));
    for seed in 0..runs {
        let mut random = StdRng::seed_from_u64(seed);
        let pairs: Vec<Pair> = (0..25)
            .map(|i| {
                let twin = Pixel::new(f64::from(i % 5) * 200.0, f64::from(i / 5) * 180.0);
                let mut real = apply(&truth(), twin).unwrap();
                real.u += 0.5 * normal(&mut random);
                real.v += 0.5 * normal(&mut random);
                Pair { real, twin }
            })
            .collect();
        let fit = fit_map(&pairs, Model::Projective, &options).unwrap();
        let m = fit.m;
        all.push(DVector::from_iterator(8, (0..8).map(|k| m[(k / 3, k % 3)])));
        told += fit.covariance / runs as f64;
    }
    let mean = all.iter().sum::<DVector<f64>>() / runs as f64;
    for k in 0..8 {
        let seen = (all.iter().map(|x| (x[k] - mean[k]).powi(2)).sum::<f64>() / runs as f64).sqrt();
        let ratio = seen / told[(k, k)].sqrt();
        // The standard error of a standard deviation from 400 runs is 3.5 %.
        assert!((ratio - 1.0).abs() < 0.12, "entry {k}: {ratio}");
    }
}

#[test]
fn leave_one_out_agrees_with_leaving_one_out() {
    let (pairs, _) = planted(&truth(), 12, 0.5, 0, 3);
    let options = Options { robust: false, noise: NoiseIn::Real, seed: 0 };
    let fit = fit_map(&pairs, Model::Projective, &options).unwrap();
    let mut sum = 0.0;
    for i in 0..pairs.len() {
        let mut others = pairs.clone();
        let left = others.remove(i);
        let m = fit_map(&others, Model::Projective, &options).unwrap().m;
        sum += apply(&m, left.twin).unwrap().distance(left.real).powi(2);
    }
    let honest = (sum / pairs.len() as f64).sqrt();
    let told = fit.leave_one_out_px.unwrap();
    // The formula is exact for linear models; this one bends by less than a percent here.
    assert!((told / honest - 1.0).abs() < 0.02, "{told} against {honest}");
    assert!(told > fit.rms_px);
}

#[test]
fn degenerate_input_is_named() {
    let options = Options::default();
    let at = |u: f64, v: f64| Pair { real: Pixel::new(u, v), twin: Pixel::new(u + 1.0, v) };
    let three = [at(0.0, 0.0), at(1.0, 0.0), at(0.0, 1.0)];
    let few = fit_map(&three, Model::Projective, &options);
    assert!(matches!(few, Err(Error::TooFew { needed: 4, given: 3, .. })), "{few:?}");
    assert!(matches!(fit_map(&[], Model::Auto, &options), Err(Error::TooFew { .. })));

    let line: Vec<Pair> =
        (0..9).map(|i| at(f64::from(i) * 7.0, 3.0 + f64::from(i) * 2.0)).collect();
    for model in [Model::Affine, Model::Projective] {
        let collinear = fit_map(&line, model, &options);
        assert!(matches!(collinear, Err(Error::Collinear { .. })), "{model:?}: {collinear:?}");
    }
    // Auto still has the scale.
    assert_eq!(fit_map(&line, Model::Auto, &options).unwrap().model, Model::Scale);

    let same = vec![at(5.0, 5.0); 6];
    let coincident = fit_map(&same, Model::Projective, &options);
    assert!(matches!(coincident, Err(Error::Coincident { .. })), "{coincident:?}");

    // All but one on a line: an affine map has a lever, a projective one has a family.
    let mut fan = line.clone();
    fan.push(at(10.0, 80.0));
    let family = fit_map(&fan, Model::Projective, &options);
    assert!(matches!(family, Err(Error::Degenerate { .. })), "{family:?}");

    let mut broken = three.to_vec();
    broken[1].real.u = f64::NAN;
    assert!(matches!(
        fit_map(&broken, Model::Auto, &options),
        Err(Error::NotFinite { row: 1, .. })
    ));
}

#[test]
fn a_map_that_sends_the_origin_to_infinity_is_named() {
    // h33 = 0: u = (v_y / v_x, 1 / v_x) scaled, a proper map of the half plane v_x > 0.
    let m = Matrix3::new(0.0, 300.0, 0.0, 0.0, 0.0, 30_000.0, 1.0, 0.0, 0.0);
    let pairs: Vec<Pair> = (0..16)
        .map(|i| {
            let twin = Pixel::new(100.0 + f64::from(i % 4) * 90.0, f64::from(i / 4) * 110.0);
            Pair { real: apply(&m, twin).unwrap(), twin }
        })
        .collect();
    let fit = fit_map(&pairs, Model::Projective, &Options::default());
    assert!(matches!(fit, Err(Error::OriginAtInfinity)), "{fit:?}");
}

#[test]
fn graffiti_pair_against_its_published_homography() {
    let Some(dir) = public("graf_homography") else { return };
    let text = std::fs::read_to_string(dir.join("matches_sift.csv")).unwrap();
    let pairs: Vec<Pair> = text
        .lines()
        .skip(1)
        .map(|line| {
            let n = numbers(line);
            Pair { twin: Pixel::new(n[0], n[1]), real: Pixel::new(n[2], n[3]) }
        })
        .collect();
    let xml = std::fs::read_to_string(dir.join("H1to3p.xml")).unwrap();
    let published: Vec<f64> = numbers(xml.split("<data>").nth(1).unwrap());
    let published = Matrix3::from_row_slice(&published[..9]);
    // On the matches that are within 3 px of the published map, least squares is within 0.6 px of it over
    // the whole picture, corners without a match included.
    let good: Vec<Pair> = pairs
        .iter()
        .filter(|p| apply(&published, p.twin).unwrap().distance(p.real) < 3.0)
        .copied()
        .collect();
    assert_eq!(good.len(), 394);
    let plain = Options { robust: false, ..Options::default() };
    let oracle = fit_map(&good, Model::Projective, &plain).unwrap();
    let rms = grid_rms(&oracle.m, &published, 800.0, 640.0);
    assert!(rms < 0.6, "{rms}");
    // The forms in the order of the paper's table; 84.9, 9.41 and 1.12 px were measured elsewhere.
    let compared = compare(&good, &oracle, &plain);
    let compared: Vec<f64> = compared.iter().map(|c| c.mse_px.sqrt()).collect();
    for (ours, theirs) in compared.iter().zip([84.9, 9.41, 1.12]) {
        assert!((ours / theirs - 1.0).abs() < 0.1, "{compared:?}");
    }
    // Left to itself the search does worse, and this is so still: some 140 matches in the lower left
    // agree with each other about 5 px beside the map, and it takes many of them in. OpenCV's MAGSAC and
    // USAC_ACCURATE are drawn the same way, to 2.01 and 2.24 px; its RANSAC with a threshold of 3 px, which
    // this search does not have, comes to 0.56 px.
    let fit = fit_map(&pairs, Model::Auto, &Options::default()).unwrap();
    let rms = grid_rms(&fit.m, &published, 800.0, 640.0);
    assert_eq!(fit.model, Model::Projective);
    assert!(rms < 2.3, "{rms}");
}
