//! Where measured and model disagree in the picture: channel by channel, and what the residual follows.

use nalgebra::Vector2;

use super::explain::CameraGap;
use super::term::Channel;
use super::views::{Data, Sight};
use super::wording::FOLLOWS;
use crate::discovery::finding;
use crate::discovery::selection::{Set, sum_of_squares};

/// A residual in one channel, and what it might follow.
struct Left {
    value: f64,
    view: usize,
    features: Vec<f64>,
}

/// Says how much of the gap each channel carries and what its residual follows.
pub(super) fn places(gap: &CameraGap) -> Vec<finding::Channel> {
    let data = &gap.data;
    let mut channels: [(Channel, Vec<Left>); 2] =
        [(Channel::U, Vec::new()), (Channel::V, Vec::new())];
    let bent = gap.bent(&[], &[]);
    for set in Set::ALL {
        for (at, left) in data.residuals(&bent, set).unwrap_or_default() {
            let sight = &data.sights[at];
            let point = data.place(&bent, sight);
            let pose = &data.views[sight.view].camera_from_world;
            let c = pose.transform_point(&point.into());
            let n = Vector2::new(c.x / c.z, c.y / c.z);
            let speed = data.speed(&bent, sight);
            for (axis, (_, found)) in channels.iter_mut().enumerate() {
                found.push(Left {
                    value: left[axis] / data.sigma,
                    view: sight.view,
                    features: features(n, axis, c.z, speed[axis], sight),
                });
            }
        }
    }
    let excess = |found: &[Left]| -> f64 {
        found.iter().map(|left| left.value * left.value - 1.0).sum::<f64>()
    };
    let total: f64 = channels.iter().map(|(_, found)| excess(found).max(0.0)).sum();
    let mut places: Vec<finding::Channel> = channels
        .iter()
        .map(|(channel, found)| {
            let excess = excess(found);
            let n = found.len().max(1) as f64;
            let square: f64 = found.iter().map(|left| left.value * left.value).sum();
            finding::Channel {
                channel: channel.name().into(),
                rms: data.sigma * (square / n).sqrt(),
                noise: data.sigma,
                unit: "px".into(),
                share: if total > 0.0 { excess.max(0.0) / total } else { 0.0 },
                // Within three standard deviations of χ² it is noise.
                concentrated_in: if excess > 3.0 * (2.0 * n).sqrt() {
                    follows(found, data)
                } else {
                    "nothing beyond noise".into()
                },
                heldout: None,
            }
        })
        .collect();
    places.sort_by(|a, b| b.share.total_cmp(&a.share));
    places
}

fn features(n: Vector2<f64>, axis: usize, depth: f64, speed: f64, sight: &Sight) -> Vec<f64> {
    vec![
        1.0,
        n.x,
        n.y,
        n[axis] * n.norm_squared(),
        n.x * n.x,
        n.x * n.y,
        n.y * n.y,
        1.0 / depth,
        speed,
        sight.pixel.y * speed,
    ]
}

/// Returns what a channel's residual follows most, and in which pictures it is.
fn follows(found: &[Left], data: &Data) -> String {
    let values: Vec<f64> = found.iter().map(|left| left.value).collect();
    let total = sum_of_squares(&values).max(1e-300);
    let mut best = (0.0, FOLLOWS[0]);
    for (at, name) in FOLLOWS.into_iter().enumerate() {
        let along: f64 = found.iter().map(|left| left.value * left.features[at]).sum();
        let norm: f64 = found.iter().map(|left| left.features[at].powi(2)).sum();
        let explained = along * along / norm.max(1e-300) / total;
        // The simpler one when both say the same.
        if explained > best.0 + 0.01 {
            best = (explained, name);
        }
    }
    let what = if best.0 > 0.3 { best.1 } else { "nothing simple" };
    let mut shares = vec![0.0; data.views.len()];
    for left in found {
        shares[left.view] += left.value * left.value / total;
    }
    let most = shares.iter().position(|share| *share > 0.7);
    match most {
        Some(view) if data.views.len() > 1 => {
            format!("{what}, mostly in view {}", data.views[view].name)
        }
        _ if data.views.len() > 1 => format!("{what}, all views"),
        _ => what.into(),
    }
}
