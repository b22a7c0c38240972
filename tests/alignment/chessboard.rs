//! Boards in `OpenCV`'s photographs, beside the corners that `cv2` refines, and the camera from them.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use trueup::alignment::chessboard::{Board, NotFound, find};
use trueup::alignment::decode;
use trueup::alignment::intrinsics::coverage::{Advice, Coverage};
use trueup::alignment::intrinsics::{Distortion, Options, View, calibrate, lens};
use trueup::world::Pixel;

use crate::absent::public;

fn board() -> Board {
    Board::new(9, 6, 0.025).unwrap()
}

/// The corners of each left view as published beside the pictures.
fn published(dir: &Path) -> BTreeMap<String, Vec<Pixel>> {
    let mut views: BTreeMap<String, Vec<Pixel>> = BTreeMap::new();
    for line in fs::read_to_string(dir.join("corners_left_cv2.csv")).unwrap().lines().skip(1) {
        let cells: Vec<&str> = line.split(',').collect();
        let pixel = Pixel::new(cells[4].parse().unwrap(), cells[5].parse().unwrap());
        views.entry(cells[0].to_owned()).or_default().push(pixel);
    }
    views
}

fn view(name: &str, corners: Vec<Pixel>) -> View {
    let points = board().points().into_iter().zip(corners).collect();
    View { name: name.to_owned(), points, world_from_camera: None }
}

fn options() -> Options {
    Options {
        skew: Some(false),
        distortion: Distortion::K1K2P1P2K3,
        image_size: Some((640, 480)),
        ..Options::default()
    }
}

#[test]
fn all_left_views_are_found_where_cv2_finds_them_and_give_a_better_camera() {
    let Some(dir) = public("opencv_chessboard") else { return };
    let published = published(&dir);
    let (mut apart, mut ours, mut theirs) = (Vec::new(), Vec::new(), Vec::new());
    for (name, corners) in published {
        let image = decode::read(&dir.join(&name)).unwrap();
        let found = find(&image, &board()).unwrap_or_else(|why| panic!("{name}: {why}"));
        apart.extend(found.iter().zip(&corners).map(|(a, b)| a.distance(*b)));
        ours.push(view(&name, found));
        theirs.push(view(&name, corners));
    }
    assert_eq!(ours.len(), 13);
    apart.sort_by(f64::total_cmp);
    let (median, most) = (apart[apart.len() / 2], apart[apart.len() - 1]);
    assert!(median < 0.1 && most < 0.5, "{median} {most}");
    // cv2 with its own corners: 0.19542 px.
    let fit = calibrate(&theirs, &options()).unwrap();
    assert!((fit.rms_px - 0.195_42).abs() < 1e-4, "{}", fit.rms_px);
    assert!((fit.intrinsics.fx - 532.827).abs() < 0.1, "{}", fit.intrinsics.fx);
    let fit = calibrate(&ours, &options()).unwrap();
    assert!(fit.rms_px < 0.1954, "{}", fit.rms_px);
    let (chosen, compared) = lens::choose(&ours, &options()).unwrap();
    assert_eq!(compared.len(), Distortion::ALL.len());
    let k = chosen.intrinsics;
    assert!(k.k1 < 0.0 && k.p1.abs() > 3.0 * chosen.std[7] && chosen.rms_px < 0.1954, "{k:?}");
    // Of 702 corners 4 lie in the ninth at the top left.
    let advice = Coverage::of(&chosen, &ours).advice(&chosen);
    assert_eq!(advice, [Advice::Empty { places: vec![(0, 0)] }]);
}

#[test]
fn all_right_views_are_found() {
    let Some(dir) = public("opencv_chessboard") else { return };
    for i in (1..=14).filter(|i| *i != 10) {
        let image = decode::read(&dir.join(format!("right{i:02}.jpg"))).unwrap();
        assert!(find(&image, &board()).is_ok(), "right{i:02}");
    }
}

#[test]
fn a_board_of_another_size_is_named_in_a_photograph() {
    let Some(dir) = public("opencv_chessboard") else { return };
    let image = decode::read(&dir.join("left01.jpg")).unwrap();
    let other = Board::new(8, 6, 0.025).unwrap();
    let named = NotFound::OtherSize { columns: 9, rows: 6, asked: (8, 6) };
    assert_eq!(find(&image, &other), Err(named));
}
