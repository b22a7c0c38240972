//! The integrators have their orders, and derivatives are derivatives.

use trueup::discovery::equation::integrate::{Rates, Stuck, Tolerance, Work, dopri5, rk4};
use trueup::discovery::equation::number::{Dual, Number};

/// A pendulum without friction, small enough a case to know exactly: `x'' = -x`.
struct Oscillator(usize);

impl<N: Number> Rates<N> for Oscillator {
    fn rates(&mut self, _: f64, x: &[N], dx: &mut [N]) {
        self.0 += 1;
        dx[0] = x[1];
        dx[1] = -x[0];
    }
}

fn rk4_error(n: u32) -> f64 {
    let mut x = [1.0, 0.0];
    let mut work = Work::new(2);
    let h = 2.0 / f64::from(n);
    for i in 0..n {
        rk4(&mut Oscillator(0), (f64::from(i) * h, h), false, &mut x, &mut work);
    }
    (x[0] - 2.0_f64.cos()).hypot(x[1] + 2.0_f64.sin())
}

#[test]
fn the_fixed_step_is_of_order_four() {
    let order = (rk4_error(20) / rk4_error(40)).log2();
    assert!((order - 4.0).abs() < 0.15, "{order}");
}

#[test]
fn the_adaptive_step_keeps_its_tolerance_and_is_of_order_five() {
    let run = |tolerance: f64| {
        let mut x = [1.0, 0.0];
        let tolerance = Tolerance { relative: tolerance, absolute: tolerance };
        let steps =
            dopri5(&mut Oscillator(0), (0.0, 2.0), &mut x, tolerance, &mut Work::new(2)).unwrap();
        ((x[0] - 2.0_f64.cos()).hypot(x[1] + 2.0_f64.sin()), steps as f64)
    };
    for tolerance in [1e-4, 1e-6, 1e-8, 1e-10] {
        let (error, _) = run(tolerance);
        assert!(error < 10.0 * tolerance, "{tolerance}: {error}");
    }
    // The error per step is of order 5 in the controlled estimate: steps grow as tolerance^(-1/5).
    let (coarse, fine) = (run(1e-6).1, run(1e-11).1);
    let order = 5.0 / (fine / coarse).log10();
    assert!((order - 5.0).abs() < 0.5, "{order}");
}

#[test]
fn what_goes_to_infinity_is_told() {
    struct Runaway;
    impl Rates<f64> for Runaway {
        fn rates(&mut self, _: f64, x: &[f64], dx: &mut [f64]) {
            dx[0] = x[0] * x[0];
        }
    }
    let tolerance = Tolerance { relative: 1e-6, absolute: 1e-6 };
    let stuck =
        dopri5(&mut Runaway, (0.0, 3.0), &mut [1.0], tolerance, &mut Work::new(1)).unwrap_err();
    let (Stuck::NotFinite { t } | Stuck::TooStiff { t }) = stuck;
    assert!((t - 1.0).abs() < 1e-3, "{stuck}");
}

#[test]
fn duals_carry_the_derivative_of_a_quotient_and_a_chain() {
    let x = Dual::<2>::variable(1.3, 0, 1.0);
    let y = Dual::<2>::variable(0.7, 1, 1.0);
    let f = (x * y + x) / (y - x * x);
    let g = |x: f64, y: f64| (x * y + x) / (y - x * x);
    let h = 1e-6;
    assert!((f.d[0] - (g(1.3 + h, 0.7) - g(1.3 - h, 0.7)) / (2.0 * h)).abs() < 1e-8);
    assert!((f.d[1] - (g(1.3, 0.7 + h) - g(1.3, 0.7 - h)) / (2.0 * h)).abs() < 1e-8);
}
