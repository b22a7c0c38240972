//! A fisheye of 172 degrees: boards in drawn pictures are found, and the camera comes out as it was drawn.

use nalgebra::{Rotation3, Vector3};
use trueup::alignment::chessboard::find;
use trueup::alignment::intrinsics::strays::without;
use trueup::alignment::intrinsics::{Distortion, Options, View, lens};
use trueup::world::{Intrinsics, LensModel, Pixel};

use super::drawn_board::Photo;

/// 900 x 900 px, 86 degrees from the axis at the middle of a side.
fn wide() -> Intrinsics {
    let mut k = Intrinsics::centred(300.0, 900, 900);
    (k.cx, k.cy, k.fy) = (455.3, 446.1, 301.5);
    (k.k1, k.k2, k.k3, k.k4, k.model) = (0.02, -0.008, 0.003, -0.001, LensModel::Fisheye);
    k
}

/// Boards to all sides, up to 58 degrees from the axis, each leaning a little.
pub(crate) fn photos() -> Vec<Photo> {
    let at = |i: u32, right: f64, down: f64, lean: [f64; 3]| {
        let (x, y) = (-down.to_radians(), right.to_radians());
        let towards = Rotation3::from_euler_angles(x, y, 0.0) * Vector3::z();
        let mut photo = Photo::new(9, 6, [x + lean[0], y + lean[1], lean[2]]);
        photo.lens = wide();
        photo.middle = (towards * 0.28).into();
        photo.seed = u64::from(i);
        photo
    };
    vec![
        at(0, 0.0, 0.0, [0.4, 0.1, 0.0]),
        at(1, 5.0, -5.0, [-0.1, -0.5, 0.3]),
        at(2, 45.0, 0.0, [0.2, 0.2, 0.0]),
        at(3, -45.0, 5.0, [-0.2, -0.1, 0.4]),
        at(4, 0.0, 42.0, [0.2, 0.3, 0.1]),
        at(5, 5.0, -42.0, [0.1, -0.2, 0.0]),
        at(6, 35.0, 32.0, [-0.3, 0.1, -0.6]),
        at(7, -35.0, 30.0, [0.1, 0.3, 0.6]),
        at(8, -34.0, -33.0, [0.2, -0.2, -0.5]),
        at(9, 36.0, -30.0, [0.2, 0.1, 0.6]),
        at(10, 58.0, 0.0, [0.0, 0.0, 0.0]),
        at(11, -58.0, 2.0, [0.1, 0.0, 0.0]),
    ]
}

fn options() -> Options {
    Options { skew: Some(false), image_size: Some((900, 900)), ..Options::default() }
}

#[test]
fn bent_boards_are_found_and_the_fisheye_is_chosen_and_right() {
    let (mut views, mut squares, mut n) = (Vec::new(), 0.0, 0.0);
    for (i, photo) in photos().iter().enumerate() {
        let found = find(&photo.taken(), &photo.board).unwrap_or_else(|why| panic!("{i}: {why}"));
        for (a, b) in found.iter().zip(photo.truth()) {
            assert!(a.distance(b) < 0.6, "{i}: {a:?} {b:?}");
            squares += a.distance(b).powi(2);
            n += 1.0;
        }
        let points = photo.board.points().into_iter().zip(found).collect();
        views.push(View { name: format!("{i}"), points, world_from_camera: None });
    }
    let rms: f64 = f64::sqrt(squares / n);
    assert!(rms < 0.1, "{rms}");
    let (fit, compared) =
        without(&views, |views| lens::choose(views, &options())).map(|found| found.fit).unwrap();
    let (k, truth) = (fit.intrinsics, wide());
    assert_eq!(k.model, LensModel::Fisheye, "{compared:?}");
    let pairs = [(k.fx, truth.fx), (k.fy, truth.fy), (k.cx, truth.cx), (k.cy, truth.cy)];
    for (i, (found, planted)) in pairs.into_iter().enumerate() {
        assert!((found - planted).abs() < 4.0 * fit.std[i].max(0.01), "{i}: {found} {planted}");
    }
    assert!(fit.rms_px < 0.1, "{}", fit.rms_px);
    // What the picture shows at its rim is where it was drawn to a fifth of a pixel, some 0.04 degrees.
    for pixel in [(0.0, 450.0), (899.0, 450.0), (450.0, 0.0), (450.0, 899.0), (200.0, 200.0)] {
        let pixel = Pixel::new(pixel.0, pixel.1);
        let apart = k.direction(pixel).angle(&truth.direction(pixel));
        assert!(apart.to_degrees() < 0.1, "{pixel:?}: {}", apart.to_degrees());
    }
}

/// The pictures of an ordinary lens do not become a fisheye's.
#[test]
fn an_ordinary_lens_stays_one_and_its_strays_do_not_move_it() {
    let turns = [[0.5, 0.0], [0.0, 0.6], [-0.6, 0.1], [0.1, -0.5], [0.4, 0.4], [0.1, 0.0]];
    let mut views: Vec<View> = turns
        .iter()
        .enumerate()
        .map(|(i, [x, y])| {
            let mut photo = Photo::new(9, 6, [*x, *y, 0.1]);
            photo.middle = [0.0, 0.0, 0.33];
            let found = find(&photo.taken(), &photo.board).unwrap();
            let points = photo.board.points().into_iter().zip(found).collect();
            View { name: format!("{i}"), points, world_from_camera: None }
        })
        .collect();
    let options = Options { image_size: Some((640, 480)), ..options() };
    let clean = without(&views, |views| lens::choose(views, &options)).unwrap();
    assert_eq!(clean.fit.0.intrinsics.model, LensModel::Brown);
    assert!(clean.strays.is_empty(), "{:?}", clean.strays);
    for (view, point, off) in [(0, 3, 1.5), (2, 40, -3.0), (3, 11, 25.0), (5, 53, 0.8)] {
        views[view].points[point].1.u += off;
    }
    let found = without(&views, |views| lens::choose(views, &options)).unwrap();
    let out: Vec<_> = found.strays.iter().map(|stray| (stray.view, stray.point)).collect();
    assert_eq!(out, [(0, 3), (2, 40), (3, 11), (5, 53)]);
    let (a, b) = (found.fit.0, clean.fit.0);
    assert!(
        (a.intrinsics.fx - b.intrinsics.fx).abs() < b.std[0],
        "{} {}",
        a.intrinsics.fx,
        b.intrinsics.fx
    );
    assert!(Distortion::ALL.len() == found.fit.1.len(), "{:?}", found.fit.1);
}
