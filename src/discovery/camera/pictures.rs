//! The pictures that would settle a doubt: where to hold a target so that two explanations foresee different pixels.
//!
//! A board of nine points is tried near and far, in the middle and at the edges, square to the camera and tilted; the
//! pose in which the explanations differ most comes first, then the one that adds most to it, and so on. What the
//! second explanation could take back by other sizes of its effects, as far as the pictures taken allow, is no
//! difference.
//!
//! Source: Atkinson and Fedorov, "The design of experiments for discriminating between two rival models", 1975.

use std::fmt::Write as _;

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

use super::explain::CameraGap;
use super::term::Law;
use super::wording;
use crate::discovery::selection::{Hypothesis, Residuals as _, Set, left_after};

/// How many poses are proposed.
const MOST: usize = 5;

/// Explanations that differ by less than this (in the sum of squares) are not told apart: five standard deviations.
const TOLD_APART: f64 = 25.0;

/// How far above the table a target is held at least, m.
const ABOVE: f64 = 0.02;

/// Pictures to take.
#[derive(Debug, Clone, PartialEq)]
pub struct Pictures {
    /// Where the target goes: a table of poses in the world.
    pub csv: String,
    /// How far the two explanations are apart on all of them, in standard deviations.
    pub separation: f64,
    /// The first pose in words.
    pub words: String,
}

/// A target as it might be held, with words for it.
struct Held {
    world_from_target: Isometry3<f64>,
    words: String,
}

/// Proposes pictures that tell two explanations of a camera of known pose apart; `None` when none tried does.
pub fn settle(gap: &CameraGap, rivals: [&Hypothesis<Law>; 2]) -> Option<Pictures> {
    let data = &gap.data;
    if !data.posed {
        return None;
    }
    let tried = tried(gap);
    let seen: Vec<Foreseen> =
        tried.iter().map(|held| Foreseen::of(gap, rivals, held)).collect::<Option<_>>()?;
    let old = Foreseen::of_taken(gap, rivals)?;
    let mut chosen: Vec<usize> = Vec::new();
    let mut least = 0.0;
    while chosen.len() < MOST {
        let next = (0..tried.len())
            .filter(|at| !chosen.contains(at))
            .map(|at| {
                let parts = chosen.iter().chain([&at]).map(|at| &seen[*at]);
                (Foreseen::left([&old].into_iter().chain(parts)), at)
            })
            .max_by(|a, b| a.0.total_cmp(&b.0).then(b.1.cmp(&a.1)))?;
        least = next.0;
        chosen.push(next.1);
    }
    if least < TOLD_APART {
        return None;
    }
    let mut csv = String::from("pose,x[m],y[m],z[m],qw,qx,qy,qz\n");
    for (number, at) in chosen.iter().enumerate() {
        let pose = &tried[*at].world_from_target;
        let (t, q) = (pose.translation.vector, pose.rotation.quaternion());
        let _ = writeln!(
            csv,
            "{},{:.4},{:.4},{:.4},{:.6},{:.6},{:.6},{:.6}",
            number + 1,
            t.x,
            t.y,
            t.z,
            q.w,
            q.i,
            q.j,
            q.k
        );
    }
    Some(Pictures { csv, separation: least.sqrt(), words: tried[chosen[0]].words.clone() })
}

/// What two explanations foresee in one picture: their difference and what the second could take back.
struct Foreseen {
    difference: Vec<f64>,
    columns: Vec<Vec<f64>>,
}

/// The pixels, in standard deviations, that an explanation with some parameters foresees.
type Foresight<'a> = dyn Fn(&Hypothesis<Law>, &[f64]) -> Option<Vec<f64>> + 'a;

impl Foreseen {
    /// Of a board held somewhere.
    fn of(gap: &CameraGap, rivals: [&Hypothesis<Law>; 2], held: &Held) -> Option<Self> {
        let view = gap.data.views.first()?;
        let pose = view.camera_from_world * held.world_from_target;
        // In the pictures taken the board would be a third as wide as the points now spread.
        let half = 0.15 * gap.data.extent * pose.translation.vector.z;
        let points: Vec<Vector3<f64>> = (-1..=1)
            .flat_map(|i| (-1..=1).map(move |j| Vector3::new(f64::from(i), f64::from(j), 0.0)))
            .map(|p| pose.transform_point(&(p * half).into()).coords)
            .collect();
        let foreseen = |h: &Hypothesis<Law>, parameters: &[f64]| -> Option<Vec<f64>> {
            let bent = gap.bent(&h.terms, parameters);
            let mut pixels = Vec::new();
            for point in &points {
                let pixel = bent.pixel(*point, 0.0)? / gap.data.sigma;
                pixels.extend([pixel.x, pixel.y]);
            }
            Some(pixels)
        };
        Self::between(gap, rivals, &foreseen)
    }

    /// Of the pictures that were taken.
    fn of_taken(gap: &CameraGap, rivals: [&Hypothesis<Law>; 2]) -> Option<Self> {
        let foreseen = |h: &Hypothesis<Law>, parameters: &[f64]| {
            let residuals = gap.residuals(Set::Train, &h.terms, parameters)?;
            Some(residuals.into_iter().map(|r| -r).collect())
        };
        Self::between(gap, rivals, &foreseen)
    }

    fn between(
        gap: &CameraGap,
        [one, other]: [&Hypothesis<Law>; 2],
        foreseen: &Foresight<'_>,
    ) -> Option<Self> {
        let here = foreseen(other, &other.parameters)?;
        let difference =
            foreseen(one, &one.parameters)?.iter().zip(&here).map(|(a, b)| a - b).collect();
        let specs = other.terms.iter().flat_map(|term| gap.specs(term));
        let mut columns = Vec::new();
        for (at, spec) in specs.enumerate() {
            let mut moved = other.parameters.clone();
            moved[at] += spec.scale;
            let there = foreseen(other, &moved)?;
            columns.push(there.iter().zip(&here).map(|(a, b)| a - b).collect());
        }
        Some(Self { difference, columns })
    }

    /// Returns the sum of squares by which the two differ in some pictures together.
    fn left<'a>(pictures: impl Iterator<Item = &'a Self>) -> f64 {
        let mut all = Self { difference: Vec::new(), columns: Vec::new() };
        for picture in pictures {
            all.difference.extend(&picture.difference);
            all.columns.resize(picture.columns.len(), Vec::new());
            for (column, more) in all.columns.iter_mut().zip(&picture.columns) {
                column.extend(more);
            }
        }
        let columns: Vec<&[f64]> = all.columns.iter().map(Vec::as_slice).collect();
        left_after(&columns, &all.difference).unwrap_or(0.0)
    }
}

/// The poses tried, in front of the first view's camera.
fn tried(gap: &CameraGap) -> Vec<Held> {
    let data = &gap.data;
    let Some(view) = data.views.first() else { return Vec::new() };
    let world_from_camera = view.camera_from_world.inverse();
    let depths: Vec<f64> = data
        .sights
        .iter()
        .map(|s| data.views[s.view].camera_from_world.transform_point(&s.point.into()).z)
        .collect();
    let depth = depths.iter().sum::<f64>() / depths.len().max(1) as f64;
    let on_table = data.sights.iter().any(super::views::Sight::on_table);
    let mut all = Vec::new();
    for (part, far) in wording::FAR {
        for (x, y, side) in wording::SIDES {
            for (tilt_x, tilt_y, how) in wording::HELD {
                let z = part * depth;
                let reach = 0.8 * data.extent * z;
                let at = Translation3::new(x * reach, y * reach, z);
                let turned = UnitQuaternion::from_euler_angles(tilt_x, tilt_y, 0.0);
                let world_from_target = world_from_camera * Isometry3::from_parts(at, turned);
                if on_table && world_from_target.translation.vector.z < ABOVE {
                    continue;
                }
                all.push(Held { world_from_target, words: format!("{far}, {side}, {how}") });
            }
        }
    }
    all
}
