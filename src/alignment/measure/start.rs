//! Where the fit of a solid to an outline begins: as near, as wide and as high as the outline's place on the table allows.

use std::f64::consts::FRAC_PI_2;

use nalgebra::Vector2;

use crate::alignment::outline::Projector;

/// Where a fit begins.
pub(super) struct Start {
    /// The foot's nearest place to the camera, m.
    near: Vector2<f64>,
    /// Away from the camera on the table, of length 1.
    away: Vector2<f64>,
    /// Across, m.
    width: f64,
    /// The longer side of the outline's box, px.
    pub(super) size_px: f64,
}

impl Start {
    /// Reads it off an outline: what is nearest to the camera on the table is on the foot.
    pub(super) fn of(view: &Projector, points: &[Vector2<f64>]) -> Option<Self> {
        let ground: Vec<Vector2<f64>> =
            points.iter().filter_map(|p| Some(view.on_plane(*p, 0.0)?.xy())).collect();
        let eye = view.eye().xy();
        let middle = ground.iter().sum::<Vector2<f64>>() / ground.len().max(1) as f64;
        let away = (middle - eye).try_normalize(1e-9)?;
        let near = ground.iter().map(|p| (p - eye).dot(&away)).fold(f64::INFINITY, f64::min);
        let across = ground.iter().map(|p| (p - eye).perp(&away));
        let (left, right) =
            across.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, r), at| (l.min(at), r.max(at)));
        let [low, high] = [f64::min, f64::max].map(|of: fn(f64, f64) -> f64| {
            points.iter().copied().reduce(|a, b| Vector2::new(of(a.x, b.x), of(a.y, b.y)))
        });
        // `perp` is positive to one side; the middle of both sides is on the line through the foot's middle.
        let aside = Vector2::new(away.y, -away.x) * (0.5 * (left + right));
        Some(Self {
            near: eye + away * near + aside,
            away,
            width: right - left,
            size_px: (high? - low?).amax(),
        })
        .filter(|start| start.width > 0.0 && start.width.is_finite())
    }

    /// Place, logarithm of height and radius of a cylinder so many widths high.
    pub(super) fn cylinder(&self, height: f64) -> Vec<f64> {
        let radius = 0.5 * self.width;
        let at = self.near + self.away * radius;
        vec![at.x, at.y, (height * self.width).ln(), radius.ln()]
    }

    /// Place, logarithms of height and sides, and turn of a cuboid so many widths high.
    pub(super) fn cuboid(&self, height: f64, turn: f64) -> Vec<f64> {
        let at = self.near + self.away * (0.5 * self.width);
        let side = (0.8 * self.width).ln();
        let yaw = self.away.y.atan2(self.away.x) + turn * FRAC_PI_2;
        vec![at.x, at.y, (height * self.width).ln(), side, side, yaw]
    }
}
