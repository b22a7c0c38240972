//! Regression 1: how far a map says it can be trusted, and what it warns of.

use nalgebra::{Matrix3, Vector2};
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};
use trueup::alignment::Error;
use trueup::alignment::image_map::{
    MapFit, Model, NoiseIn, Options, Pair, Side, Warning, apply, fit_map, fit_map_ranked, reached,
};
use trueup::world::Pixel;

use super::support::normal;

/// The twin's picture of all cases.
const SIZE: Vector2<f64> = Vector2::new(1000.0, 800.0);

fn truth() -> Matrix3<f64> {
    Matrix3::new(0.92, -0.08, 60.0, 0.11, 0.95, -35.0, 1.5e-4, -9e-5, 1.0)
}

/// Pairs under the truth at these places, with noise of `sigma` px in the real picture.
fn seen(places: impl Iterator<Item = (f64, f64)>, sigma: f64, seed: u64) -> Vec<Pair> {
    let mut random = StdRng::seed_from_u64(seed);
    let pair = |(u, v)| {
        let twin = Pixel::new(u, v);
        let at = apply(&truth(), twin).unwrap();
        let (du, dv) = (sigma * normal(&mut random), sigma * normal(&mut random));
        Pair { real: Pixel::new(at.u + du, at.v + dv), twin }
    };
    places.map(pair).collect()
}

fn grid(low: (f64, f64), high: (f64, f64)) -> impl Iterator<Item = (f64, f64)> {
    (0..25).map(move |k| {
        let (i, j) = (f64::from(k % 5) / 4.0, f64::from(k / 5) / 4.0);
        (low.0 + (high.0 - low.0) * i, low.1 + (high.1 - low.1) * j)
    })
}

fn fit(pairs: &[Pair]) -> MapFit {
    fit_map(pairs, Model::Projective, &Options::default()).unwrap()
}

fn codes(pairs: &[Pair]) -> Vec<&'static str> {
    fit(pairs).warnings(pairs, SIZE).iter().map(Warning::code).collect()
}

#[test]
fn a_map_of_points_all_over_the_picture_warns_of_nothing() {
    for seed in 0..20 {
        assert_eq!(codes(&seen(grid((20.0, 20.0), (980.0, 780.0)), 0.5, seed)), [""; 0]);
    }
}

#[test]
fn the_uncertainty_is_what_repetition_shows_over_the_picture() {
    let options = Options { robust: false, noise: NoiseIn::Real, seed: 0 };
    let runs = 200;
    let place = |k: usize| [Pixel::new(0.0, 0.0), Pixel::new(500.0, 400.0)][k];
    let (mut squares, mut told) = ([0.0; 2], [0.0; 2]);
    for seed in 0..runs {
        let pairs = seen(grid((300.0, 200.0), (700.0, 600.0)), 0.5, seed);
        let fit = fit_map(&pairs, Model::Projective, &options).unwrap();
        let grid = fit.uncertainty(SIZE).unwrap();
        for k in 0..2 {
            let off = fit.apply(place(k)).unwrap().distance(apply(&truth(), place(k)).unwrap());
            squares[k] += off * off / runs as f64;
            let (row, column) = [(0, 0), (3, 4)][k];
            assert_eq!((grid.u_px[column], grid.v_px[row]), (place(k).u, place(k).v));
            told[k] += grid.std_px[row][column].unwrap() / runs as f64;
        }
    }
    for k in 0..2 {
        // A standard deviation from 200 runs is known to 4 %.
        let ratio = squares[k].sqrt() / told[k];
        assert!((ratio - 1.0).abs() < 0.15, "place {k}: {ratio}");
    }
    assert!(told[0] > 5.0 * told[1], "{told:?}");
}

#[test]
fn a_patch_in_a_corner_is_called_small_and_says_where_it_ends() {
    let pairs = seen(grid((80.0, 80.0), (180.0, 160.0)), 0.5, 1);
    let warnings = fit(&pairs).warnings(&pairs, SIZE);
    let [Warning::SmallPatch { share, at, std_px }] = warnings[..] else { panic!("{warnings:?}") };
    assert!((share - 0.01).abs() < 1e-9, "{share}");
    assert_eq!((at.u, at.v), (1000.0, 800.0));
    assert!(std_px.is_none_or(|std| std > 7.0), "{std_px:?}");
    assert!(warnings[0].to_string().contains("cover 1 %"), "{}", warnings[0]);
}

#[test]
fn a_line_with_noise_is_called_a_line() {
    for seed in 0..20 {
        let along = (0..30).map(|i| (50.0 + 30.0 * f64::from(i), 100.0 + 20.0 * f64::from(i)));
        let mut random = StdRng::seed_from_u64(100 + seed);
        let pairs: Vec<Pair> = seen(along, 0.5, seed)
            .into_iter()
            .map(|pair| {
                let (du, dv) = (0.5 * normal(&mut random), 0.5 * normal(&mut random));
                Pair { twin: Pixel::new(pair.twin.u + du, pair.twin.v + dv), ..pair }
            })
            .collect();
        let Ok(fit) = fit_map(&pairs, Model::Projective, &Options::default()) else { continue };
        let warnings = fit.warnings(&pairs, SIZE);
        assert!(
            warnings.iter().any(|w| matches!(w, Warning::OnALine { side: Side::Twin, .. })),
            "seed {seed}: {warnings:?}"
        );
    }
}

#[test]
fn all_but_one_on_a_line_is_told_as_hardly_determined_or_refused() {
    for seed in 0..20 {
        let line = (0..20).map(|i| (50.0 + 40.0 * f64::from(i), 100.0 + 25.0 * f64::from(i)));
        let pairs = seen(line.chain([(200.0, 700.0)]), 0.5, seed);
        match fit_map(&pairs, Model::Projective, &Options::default()) {
            Err(error) => assert!(matches!(error, Error::Degenerate { .. }), "{error}"),
            Ok(fit) => {
                let said: Vec<_> = fit.warnings(&pairs, SIZE);
                let is_told = |w: &Warning| matches!(w.code(), "hardly_determined" | "on_a_line");
                assert!(said.iter().any(is_told), "seed {seed}: {said:?}");
            }
        }
    }
}

/// No two cameras over one table see each other's picture in a mirror; exchanged columns fit as well as the right ones.
#[test]
fn exchanged_columns_are_told_as_a_mirror() {
    let pairs = seen(grid((20.0, 20.0), (980.0, 780.0)), 0.5, 3);
    assert_eq!(codes(&pairs), [""; 0]);
    let swapped: Vec<Pair> = pairs
        .iter()
        .map(|pair| Pair { real: Pixel::new(pair.real.v, pair.real.u), ..*pair })
        .collect();
    assert_eq!(codes(&swapped), ["mirrored"]);
    // Turned upside down is no mirror.
    let turned: Vec<Pair> = pairs
        .iter()
        .map(|pair| Pair { real: Pixel::new(SIZE.x - pair.real.u, SIZE.y - pair.real.v), ..*pair })
        .collect();
    assert_eq!(codes(&turned), [""; 0]);
}

#[test]
fn pairs_at_random_are_told_from_pairs_that_agree() {
    let mut random = StdRng::seed_from_u64(5);
    for n in [12, 60, 300] {
        let mut at =
            || Pixel::new(random.random_range(0.0..1000.0), random.random_range(0.0..800.0));
        let pairs: Vec<Pair> = (0..n).map(|_| Pair { real: at(), twin: at() }).collect();
        match fit_map(&pairs, Model::Projective, &Options::default()) {
            Err(error) => assert!(matches!(error, Error::NoConsensus { .. }), "{error}"),
            Ok(fit) => {
                let warnings = fit.warnings(&pairs, SIZE);
                let is_told = |w: &Warning| matches!(w.code(), "by_chance" | "unchecked");
                assert!(warnings.iter().any(is_told), "{n}: {warnings:?}");
            }
        }
    }
    // Half of them right is no chance.
    let mut pairs = seen(grid((20.0, 20.0), (980.0, 780.0)), 0.5, 3);
    let mut at = || Pixel::new(random.random_range(0.0..1000.0), random.random_range(0.0..800.0));
    pairs.extend((0..25).map(|_| Pair { real: at(), twin: at() }));
    assert_eq!(codes(&pairs), [""; 0]);
}

/// A person saw "no four of the points are in general position" of four points in general position of which one was
/// paired wrongly.
#[test]
fn of_four_pairs_with_a_wrong_one_what_is_said_is_true() {
    let right =
        seen([(100.0, 100.0), (900.0, 120.0), (880.0, 700.0), (130.0, 650.0)].into_iter(), 0.0, 0);
    // Two exchanged: no map keeps all four in front.
    let mut crossed = right.clone();
    (crossed[0].real, crossed[1].real) = (crossed[1].real, crossed[0].real);
    let found = fit_map(&crossed, Model::Projective, &Options::default());
    assert!(matches!(found, Err(Error::Crossed { given: 4 })), "{found:?}");
    let said = found.unwrap_err().to_string();
    assert!(said.contains("paired wrongly") && !said.contains("general position"), "{said}");
    // One beside its place: any four pairs fit, and that is said.
    let mut moved = right;
    moved[2].real.u -= 60.0;
    let fit = fit(&moved);
    let warnings = fit.warnings(&moved, SIZE);
    let unchecked = Warning::Unchecked { kept: 4, left_out: 0 };
    assert_eq!(warnings.first(), Some(&unchecked), "{warnings:?}");
    assert_eq!(fit.uncertainty(SIZE), None);
    assert!(unchecked.to_string().contains("cannot be noticed"), "{unchecked}");
}

#[test]
fn a_horizon_in_the_picture_and_an_origin_near_infinity_are_told() {
    // The horizon of this map is at u = 4 px: right of it all is well.
    let m = Matrix3::new(2.0, 300.0, 0.0, 0.0, 0.0, 30_000.0, 1.0, 0.0, -4.0);
    let pairs: Vec<Pair> = (0..16)
        .map(|i| {
            let twin = Pixel::new(300.0 + f64::from(i % 4) * 90.0, f64::from(i / 4) * 110.0);
            Pair { real: apply(&m, twin).unwrap(), twin }
        })
        .collect();
    // Its corner is 4 of 435 at the points, and negative: with a 1 there, the points are beyond the horizon.
    let found = fit_map(&pairs, Model::Projective, &Options::default());
    let said = found.map(|fit| fit.warnings(&pairs, SIZE).iter().map(Warning::code).collect());
    match said {
        Ok::<Vec<_>, _>(codes) => assert!(codes.contains(&"corner_near_zero"), "{codes:?}"),
        Err(error) => assert!(matches!(error, Error::OriginAtInfinity), "{error}"),
    }
    // A horizon at the far end.
    let far = Matrix3::new(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, -1.0 / 900.0, 0.0, 1.0);
    let pairs: Vec<Pair> = grid((50.0, 50.0), (500.0, 700.0))
        .map(|(u, v)| Pair { real: apply(&far, Pixel::new(u, v)).unwrap(), twin: Pixel::new(u, v) })
        .collect();
    let warnings = fit(&pairs).warnings(&pairs, SIZE);
    assert!(warnings.iter().any(|w| matches!(w, Warning::Horizon { .. })), "{warnings:?}");
}

#[test]
fn scores_change_what_is_looked_at_first_and_not_what_is_found() {
    let mut pairs = seen(grid((20.0, 20.0), (980.0, 780.0)), 0.3, 7);
    let mut random = StdRng::seed_from_u64(8);
    let mut at = || Pixel::new(random.random_range(0.0..1000.0), random.random_range(0.0..800.0));
    pairs.extend((0..60).map(|_| Pair { real: at(), twin: at() }));
    let options = Options::default();
    let plain = fit_map(&pairs, Model::Projective, &options).unwrap();
    let helpful: Vec<f64> = (0..pairs.len()).map(|i| if i < 25 { 0.9 } else { 0.1 }).collect();
    let misleading: Vec<f64> = helpful.iter().map(|score| 1.0 - score).collect();
    for scores in [helpful, misleading] {
        let fit = fit_map_ranked(&pairs, Some(&scores), Model::Projective, &options).unwrap();
        assert_eq!(fit.outliers, plain.outliers);
        assert!((fit.m - plain.m).amax() < 1e-6 * plain.m.amax(), "{}", fit.m - plain.m);
    }
    let short = fit_map_ranked(&pairs, Some(&[1.0]), Model::Projective, &options);
    assert!(matches!(short, Err(Error::Length { given: 1, .. })), "{short:?}");
    assert!((reached(&pairs) - SIZE).amax() < 60.0);
}
