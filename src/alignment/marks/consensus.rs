//! Which blob is which mark: a similarity explains the guess's error first, then maps with more freedom, a homography last.

use nalgebra::{DMatrix, Matrix3, Vector2, Vector3};

use super::blobs::Blob;
use super::plane_point;
use crate::world::{Mark, Pixel};

/// Largest error of the guess that is searched, px. Chosen: a camera at 1 m with 900 px that is turned by 8 deg or
/// stands 14 cm beside its place. With half of it a camera that was knocked is not found again, with twice as much
/// the dots of a table, 18 cm and 150 px apart in the kitchen, are taken for each other.
const REACH_PX: f64 = 130.0;
/// How far a dot may be from its place once a homography is fitted, px: what a lens may add. Chosen: `k1` of -0.08
/// moves a point half way to the corner of a picture of 1280 px by 5 px, of which a homography takes up most. With
/// half of it dots of the corners are left out, with twice as much a dark thing beside a hidden dot passes for it.
const CLOSE_PX: f64 = 4.0;
/// Radius of a blob over that expected. A guess that is 40 % wrong in distance, and a tilt of 75°, whose root is in the
/// geometric mean of the axes: √(cos 75°) / 1.4 = 0.36, and 1 / 0.6 = 1.67.
const RATIO: std::ops::Range<f64> = 0.35..1.7;
/// Dots nearer together than this do not give a similarity, px: a centre that is 1 px off would turn it by 0.4°.
/// Chosen: with half of it the noise of a dot decides the turn, with twice as much a table that is small in the
/// picture has no pairs.
const SPAN_PX: f64 = 150.0;
/// How much a similarity may scale and turn the guess, rad: a distance wrong by a third, a camera rolled by 17°.
/// Chosen: twice as much lets a grid of dots match itself rotated, half of it is a camera that was not touched.
const SCALE: std::ops::Range<f64> = 0.75..1.33;
const ROLL: f64 = 0.3;
/// How far a dot may be from its place under a similarity, px, and then under maps with more freedom, each from the
/// pairs of the last: affine twice, then a homography. Chosen: falling from what perspective adds to a similarity to
/// [`CLOSE_PX`], each step by less than a half, so that no right dot is lost on the way; the same at half of them
/// loses dots of a tilted guess, at twice of them takes neighbours.
const SIMILAR_PX: f64 = 18.0;
const CLOSER: [(f64, bool); 5] =
    [(16.0, true), (10.0, true), (8.0, false), (CLOSE_PX, false), (CLOSE_PX, false)];
/// What pixels are divided by for the equations of an affine map, so that its columns are of like size. Any of this
/// order would do.
const CENTI: f64 = 100.0;
/// Ratio of singular values below which points do not determine a homography: far above rounding (1e-16), far below
/// the 1e-2 or so of points that are spread.
const SINGULAR: f64 = 1e-6;
/// Returns pairs (mark index, blob index) that one homography explains; empty when nothing fits.
pub(super) fn consensus(
    marks: &[Mark],
    expected: &[(usize, Pixel, f64)],
    blobs: &[Blob],
) -> Vec<(usize, usize)> {
    let at = |p: Pixel| Vector2::new(p.u, p.v);
    let near: Vec<Vec<usize>> = expected
        .iter()
        .map(|&(_, pixel, radius)| {
            (0..blobs.len())
                .filter(|&b| {
                    let ratio = blobs[b].radius / radius;
                    (blobs[b].centre - at(pixel)).norm() < REACH_PX && RATIO.contains(&ratio)
                })
                .collect()
        })
        .collect();
    // Every pair of pairs gives a similarity near the identity; the one that brings most dots close wins.
    let mut best: (usize, f64, Vec<(usize, usize)>) = (0, f64::INFINITY, Vec::new());
    for i in 0..expected.len() {
        for j in i + 1..expected.len() {
            let (pi, pj) = (at(expected[i].1), at(expected[j].1));
            let span = pj - pi;
            if span.norm() < SPAN_PX {
                continue;
            }
            for &bi in &near[i] {
                for &bj in &near[j] {
                    let seen = blobs[bj].centre - blobs[bi].centre;
                    let scale = seen.norm() / span.norm();
                    let turn = (span.x * seen.y - span.y * seen.x).atan2(span.dot(&seen));
                    if bi == bj || !SCALE.contains(&scale) || turn.abs() > ROLL {
                        continue;
                    }
                    let rotation = nalgebra::Rotation2::new(turn);
                    let map = |p: Vector2<f64>| blobs[bi].centre + rotation * (p - pi) * scale;
                    let (pairs, cost) = assign(
                        expected.len(),
                        SIMILAR_PX,
                        |k| map(at(expected[k].1)),
                        &near,
                        blobs,
                    );
                    if pairs.len() > best.0 || (pairs.len() == best.0 && cost < best.1) {
                        best = (pairs.len(), cost, pairs);
                    }
                }
            }
        }
    }
    // Then maps with more freedom and less tolerance, each from the last one's pairs.
    let mut pairs = best.2;
    for (tolerance, affine) in CLOSER {
        let places: Vec<(Vector2<f64>, Vector2<f64>)> = pairs
            .iter()
            .map(|&(k, b)| (plane_point(&marks[expected[k].0]), blobs[b].centre))
            .collect();
        let guess: Vec<(Vector2<f64>, Vector2<f64>)> =
            pairs.iter().map(|&(k, b)| (at(expected[k].1), blobs[b].centre)).collect();
        let (next, _) = if affine {
            let Some(map) = fit_affine(&guess) else { return Vec::new() };
            assign(expected.len(), tolerance, |k| map(at(expected[k].1)), &near, blobs)
        } else {
            let Some(h) = fit_homography(&places) else { return Vec::new() };
            assign(
                expected.len(),
                tolerance,
                |k| through(&h, plane_point(&marks[expected[k].0])),
                &near,
                blobs,
            )
        };
        pairs = next;
    }
    pairs.into_iter().map(|(k, b)| (expected[k].0, b)).collect()
}

/// Pairs each expected place with the nearest blob within `tolerance` px, each blob once; and the cost.
fn assign(
    n: usize,
    tolerance: f64,
    place: impl Fn(usize) -> Vector2<f64>,
    near: &[Vec<usize>],
    blobs: &[Blob],
) -> (Vec<(usize, usize)>, f64) {
    let mut offers: Vec<(f64, usize, usize)> = Vec::new();
    for (k, near) in near.iter().enumerate().take(n) {
        let p = place(k);
        for &b in near {
            let distance = (blobs[b].centre - p).norm();
            if distance < tolerance {
                offers.push((distance, k, b));
            }
        }
    }
    offers.sort_by(|x, y| x.0.total_cmp(&y.0));
    let (mut pairs, mut cost) = (Vec::<(usize, usize)>::new(), 0.0);
    for (distance, k, b) in offers {
        if pairs.iter().all(|&(pk, pb)| pk != k && pb != b) {
            pairs.push((k, b));
            cost += distance * distance;
        }
    }
    (pairs, cost)
}

/// Fits `v = A u + b` by least squares, `None` with fewer than three pairs or pairs on one line.
fn fit_affine(
    pairs: &[(Vector2<f64>, Vector2<f64>)],
) -> Option<impl Fn(Vector2<f64>) -> Vector2<f64> + use<>> {
    if pairs.len() < 3 {
        return None;
    }
    let (mut normal, mut rhs) = (Matrix3::zeros(), nalgebra::Matrix3x2::zeros());
    for (u, v) in pairs {
        let row = Vector3::new(u.x / CENTI, u.y / CENTI, 1.0);
        normal += row * row.transpose();
        rhs += row * v.transpose();
    }
    let solution = normal.try_inverse()? * rhs;
    Some(move |u: Vector2<f64>| {
        (Vector3::new(u.x / CENTI, u.y / CENTI, 1.0).transpose() * solution).transpose()
    })
}

/// Fits the homography of at least four pairs by the normalised direct linear transform.
pub(in crate::alignment) fn fit_homography(
    pairs: &[(Vector2<f64>, Vector2<f64>)],
) -> Option<Matrix3<f64>> {
    if pairs.len() < 4 {
        return None;
    }
    let normaliser = |points: &[Vector2<f64>]| {
        let n = points.len() as f64;
        let mean = points.iter().sum::<Vector2<f64>>() / n;
        let spread = points.iter().map(|p| (p - mean).norm()).sum::<f64>() / n;
        let s = std::f64::consts::SQRT_2 / spread.max(1e-12);
        Matrix3::new(s, 0.0, -s * mean.x, 0.0, s, -s * mean.y, 0.0, 0.0, 1.0)
    };
    let from: Vec<Vector2<f64>> = pairs.iter().map(|p| p.0).collect();
    let to: Vec<Vector2<f64>> = pairs.iter().map(|p| p.1).collect();
    let (tu, tv) = (normaliser(&from), normaliser(&to));
    let mut a = DMatrix::zeros((2 * pairs.len()).max(9), 9);
    for (i, (u, v)) in pairs.iter().enumerate() {
        let (u, v) = (through(&tu, *u), through(&tv, *v));
        let rows = [
            [-u.x, -u.y, -1.0, 0.0, 0.0, 0.0, v.x * u.x, v.x * u.y, v.x],
            [0.0, 0.0, 0.0, -u.x, -u.y, -1.0, v.y * u.x, v.y * u.y, v.y],
        ];
        for (k, row) in rows.iter().enumerate() {
            for (c, value) in row.iter().enumerate() {
                a[(2 * i + k, c)] = *value;
            }
        }
    }
    let svd = a.svd(false, true);
    let order = {
        let mut order: Vec<usize> = (0..svd.singular_values.len()).collect();
        order.sort_by(|&x, &y| svd.singular_values[x].total_cmp(&svd.singular_values[y]));
        order
    };
    // A second vanishing direction means that the points do not determine the map.
    if svd.singular_values[order[1]] < SINGULAR * svd.singular_values[order[8]] {
        return None;
    }
    let rows = svd.v_t?;
    let h = rows.row(order[0]);
    let normalised = Matrix3::new(h[0], h[1], h[2], h[3], h[4], h[5], h[6], h[7], h[8]);
    Some(tv.try_inverse()? * normalised * tu)
}

pub(super) fn through(h: &Matrix3<f64>, p: Vector2<f64>) -> Vector2<f64> {
    let q = h * Vector3::new(p.x, p.y, 1.0);
    q.xy() / q.z
}
