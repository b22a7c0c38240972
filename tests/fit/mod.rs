//! The solver: closed forms, laws, and what it must refuse.

use nalgebra::{DMatrix, DVector};
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};
use trueup::fit::{
    Bound, Convergence, Error, Fit, Jacobian, Loss, Noise, Options, Prior, Problem, Residuals,
    solve, solve_rejecting,
};

fn normal(random: &mut StdRng) -> f64 {
    let a: f64 = random.random_range(f64::MIN_POSITIVE..1.0);
    let b: f64 = random.random_range(0.0..std::f64::consts::TAU);
    (-2.0 * a.ln()).sqrt() * b.cos()
}

/// `y = a + b t` at ten times, with the given errors.
fn line(errors: &[f64]) -> impl Fn(&[f64], &mut [f64]) + use<'_> {
    move |x, r| {
        for (i, r) in r.iter_mut().enumerate() {
            *r = x[0] + x[1] * i as f64 - (2.0 + 0.5 * i as f64 + errors[i]);
        }
    }
}

fn solve_line(errors: &[f64], options: &Options) -> Result<Fit, Error> {
    solve(&Residuals::new(errors.len(), line(errors)), &[0.0, 0.0], options)
}

#[test]
fn a_straight_line_agrees_with_its_closed_form() {
    let errors: Vec<f64> = (0..10).map(|i| (f64::from(i * i) * 1.7).sin()).collect();
    let fit = solve_line(&errors, &Options::default()).unwrap();
    // Σ over i = 0..9: n = 10, Σi = 45, Σi² = 285.
    let a = DMatrix::from_row_slice(2, 2, &[10.0, 45.0, 45.0, 285.0]);
    let y: Vec<f64> = (0..10).map(|i| 2.0 + 0.5 * i as f64 + errors[i]).collect();
    let b = DVector::from_vec(vec![
        y.iter().sum(),
        y.iter().enumerate().map(|(i, y)| i as f64 * y).sum(),
    ]);
    let inverse = a.try_inverse().unwrap();
    let x = &inverse * b;
    let rss: f64 = (0..10).map(|i| (x[0] + x[1] * i as f64 - y[i]).powi(2)).sum();
    assert!((fit.x[0] - x[0]).abs() < 1e-9 && (fit.x[1] - x[1]).abs() < 1e-9);
    let expected = inverse * (rss / 8.0);
    assert!((&fit.covariance - &expected).amax() < 1e-7 * expected.amax());
    assert!((fit.noise_std.unwrap() - (rss / 8.0).sqrt()).abs() < 1e-9);
    assert!(fit.converged() && fit.conditioning.unobservable.is_empty());
}

#[test]
fn rosenbrock_s_valley_is_followed_to_its_end() {
    let valley = Residuals::new(2, |x: &[f64], r: &mut [f64]| {
        r[0] = 10.0 * (x[1] - x[0] * x[0]);
        r[1] = 1.0 - x[0];
    });
    let fit = solve(&valley, &[-1.2, 1.0], &Options::default()).unwrap();
    assert!((fit.x[0] - 1.0).abs() < 1e-8 && (fit.x[1] - 1.0).abs() < 1e-8, "{:?}", fit.x);
    assert_ne!(fit.convergence, Convergence::IterationLimit);
}

#[test]
fn a_cauchy_loss_shrugs_off_what_bends_least_squares() {
    let mut errors = vec![0.0; 30];
    for (i, e) in errors.iter_mut().enumerate() {
        *e = 0.01 * (i as f64 * 2.3).sin();
    }
    for i in [3, 11, 12, 25] {
        errors[i] = 40.0;
    }
    let bent = solve_line(&errors, &Options::default()).unwrap();
    let options = Options { loss: Loss::Cauchy(0.03), ..Options::default() };
    let straight = solve_line(&errors, &options).unwrap();
    assert!((bent.x[0] - 2.0).abs() > 1.0);
    assert!((straight.x[0] - 2.0).abs() < 0.02 && (straight.x[1] - 0.5).abs() < 0.002);
    assert!(straight.robust_weights[11] < 1e-4 && straight.robust_weights[10] > 0.5);

    let whitened = |x: &[f64], r: &mut [f64]| {
        line(&errors)(x, r);
        for r in r {
            *r /= 0.01;
        }
    };
    let kept =
        solve_rejecting(&Residuals::new(30, whitened), &[0.0, 0.0], &Options::default(), 4.0)
            .unwrap();
    assert_eq!(kept.outliers, [3, 11, 12, 25]);
    assert!((kept.fit.x[0] - 2.0).abs() < 0.02);
}

#[test]
fn the_covariance_is_what_repetition_shows_even_under_a_robust_loss() {
    for (loss, noise) in [
        (Loss::None, Noise::Known),
        (Loss::None, Noise::Estimated),
        (Loss::Huber(1.345), Noise::Estimated),
        (Loss::Cauchy(2.385), Noise::Estimated),
    ] {
        let mut random = StdRng::seed_from_u64(4);
        let runs = 500;
        let (mut slopes, mut told) = (Vec::new(), 0.0);
        for _ in 0..runs {
            let errors: Vec<f64> = (0..40).map(|_| normal(&mut random)).collect();
            let fit = solve_line(&errors, &Options { loss, noise, ..Options::default() }).unwrap();
            slopes.push(fit.x[1] - 0.5);
            told += fit.covariance[(1, 1)] / f64::from(runs);
        }
        let seen = slopes.iter().map(|s| s * s).sum::<f64>() / f64::from(runs);
        let ratio = (seen / told).sqrt();
        // The standard error of a standard deviation from 500 runs is 3.2 %.
        assert!((ratio - 1.0).abs() < 0.1, "{loss:?} {noise:?}: {ratio}");
    }
}

#[test]
fn what_the_data_cannot_tell_is_named() {
    // Only x0 + x1 is measured; x2 not at all.
    let sum = Residuals::new(5, |x: &[f64], r: &mut [f64]| {
        for (i, r) in r.iter_mut().enumerate() {
            *r = x[0] + x[1] - (3.0 + 0.1 * (i as f64 - 2.0));
        }
    });
    let fit = solve(&sum, &[0.0, 1.0, 7.0], &Options::default()).unwrap();
    let named: Vec<Vec<usize>> = fit
        .conditioning
        .unobservable
        .iter()
        .map(|d| {
            let mut parameters: Vec<usize> = d.parameters.iter().map(|p| p.0).collect();
            parameters.sort_unstable();
            parameters
        })
        .collect();
    assert_eq!(named.len(), 2, "{named:?}");
    assert!(named.contains(&vec![0, 1]) && named.contains(&vec![2]), "{named:?}");
    assert_eq!(fit.conditioning.undetermined, [0, 1, 2]);
    assert!(fit.std(0).is_infinite());
    assert!((fit.x[0] + fit.x[1] - 3.0).abs() < 1e-9 && (fit.x[2] - 7.0).abs() < 1e-12);

    // A prior settles it, and the data still do not.
    let priors = vec![
        Prior { parameter: 0, mean: 1.0, std: 0.5 },
        Prior { parameter: 2, mean: -2.0, std: 0.1 },
    ];
    let options = Options { priors, noise: Noise::Known, ..Options::default() };
    let fit = solve(&sum, &[0.0, 1.0, 7.0], &options).unwrap();
    assert!((fit.x[0] - 1.0).abs() < 1e-8 && (fit.x[1] - 2.0).abs() < 1e-8);
    assert!((fit.x[2] + 2.0).abs() < 1e-8 && (fit.std(2) - 0.1).abs() < 1e-9);
    assert!((fit.std(0) - 0.5).abs() < 1e-9);
    assert_eq!(fit.conditioning.unobservable.len(), 2);
    assert!(fit.conditioning.undetermined.is_empty());
}

#[test]
fn fixed_parameters_stay_and_bounds_hold() {
    let errors = vec![0.0; 10];
    let fixed = Options { fixed: vec![1], ..Options::default() };
    let fit = solve(&Residuals::new(10, line(&errors)), &[0.0, 0.3], &fixed).unwrap();
    assert!((fit.x[1] - 0.3).abs() < 1e-15);
    // The best intercept for a slope 0.2 too small: 2 + 0.2 · mean(i).
    assert!((fit.x[0] - 2.9).abs() < 1e-9);

    let bounds = vec![Bound { parameter: 1, lower: 0.0, upper: 0.3 }];
    let bound = Options { bounds, ..Options::default() };
    let fit = solve_line(&errors, &bound).unwrap();
    assert!((fit.x[1] - 0.3).abs() < 1e-12 && (fit.x[0] - 2.9).abs() < 1e-7, "{:?}", fit.x);
}

/// Many views of a line, one offset each: mostly zeros, and large enough for the second linear algebra.
struct Views {
    n: usize,
}

impl Problem for Views {
    fn n_residuals(&self) -> usize {
        6 * self.n
    }
    fn residuals(&self, x: &[f64], r: &mut [f64]) {
        for (k, r) in r.iter_mut().enumerate() {
            let (view, t) = (k / 6, (k % 6) as f64);
            *r = (x[0] * t).exp() + x[1 + view] - ((0.3 * t).exp() + view as f64);
        }
    }
    fn jacobian(&self, x: &[f64], j: &mut Jacobian) -> bool {
        for k in 0..6 * self.n {
            let t = (k % 6) as f64;
            j.row_mut(k)[0] = t * (x[0] * t).exp();
            j.row_mut(k)[1 + k / 6] = 1.0;
        }
        true
    }
}

#[test]
fn a_large_sparse_problem_finds_its_planted_truth() {
    let views = Views { n: 50 };
    let fit = solve(&views, &[0.0; 51], &Options::default()).unwrap();
    assert!((fit.x[0] - 0.3).abs() < 1e-9);
    for view in 0..50 {
        assert!((fit.x[1 + view] - view as f64).abs() < 1e-8);
    }
}

#[test]
fn numerical_derivatives_agree_with_the_formula() {
    let views = Views { n: 4 };
    let numerical = Residuals::new(24, |x: &[f64], r: &mut [f64]| views.residuals(x, r));
    let start = [0.1, 0.5, -0.5, 0.0, 1.0];
    let options = Options { noise: Noise::Known, ..Options::default() };
    let (a, b) =
        (solve(&views, &start, &options).unwrap(), solve(&numerical, &start, &options).unwrap());
    assert!((&a.covariance - &b.covariance).amax() < 1e-7 * a.covariance.amax());
}

#[test]
fn bad_questions_are_refused() {
    let errors = [0.0];
    let few = solve_line(&errors, &Options::default());
    assert_eq!(few, Err(Error::TooFew { residuals: 1, priors: 0, parameters: 2 }));
    let nan = Residuals::new(3, |_: &[f64], r: &mut [f64]| r.fill(f64::NAN));
    assert_eq!(solve(&nan, &[0.0], &Options::default()), Err(Error::NotFinite { residual: 0 }));
    let errors = [0.0; 4];
    for options in [
        Options { fixed: vec![2], ..Options::default() },
        Options { priors: vec![Prior { parameter: 0, mean: 0.0, std: 0.0 }], ..Options::default() },
        Options {
            bounds: vec![Bound { parameter: 0, lower: 1.0, upper: 0.0 }],
            ..Options::default()
        },
        Options { weights: vec![1.0; 3], ..Options::default() },
        Options { loss: Loss::Huber(0.0), ..Options::default() },
    ] {
        assert!(matches!(solve_line(&errors, &options), Err(Error::Option { .. })), "{options:?}");
    }
}

#[test]
fn a_step_out_of_the_domain_is_shortened() {
    // ln x is not a number for x <= 0; the full first step would land there.
    let domain = Residuals::new(1, |x: &[f64], r: &mut [f64]| r[0] = x[0].ln() + 3.0);
    let fit = solve(&domain, &[5.0], &Options::default()).unwrap();
    assert!((fit.x[0] - (-3.0_f64).exp()).abs() < 1e-8);
}
