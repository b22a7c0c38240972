//! What `trueup camera see` prints, as `INTERFACES.md` fixes it.

use serde::Serialize;

use crate::alignment::outline::ObjectPose;
use crate::alignment::vision::{MaskIs, Sighting, Way};

/// The answer of `camera see`, as `INTERFACES.md` fixes it.
#[derive(Debug, Clone, Serialize)]
pub struct Answer {
    /// One entry per object of the scene.
    pub objects: Vec<ObjectAnswer>,
}

/// One object in the answer of `camera see`.
#[derive(Debug, Clone, Serialize)]
pub struct ObjectAnswer {
    /// The object's name.
    pub name: String,
    /// Whether it is there.
    pub found: bool,
    /// Where its mask was written.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mask: Option<String>,
    /// `[u0, v0, u1, v1]`, px.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bbox_px: Option<[f64; 4]>,
    /// Key points, px.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub key_points_px: Option<Vec<[f64; 2]>>,
    /// `measured` when the key points are the contour's own, `projected` when they are the placed solid's.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub key_points_are: Option<&'static str>,
    /// Its pose.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub world_from_object: Option<ObjectPose>,
    /// Where it most probably is when it was not found, if anywhere.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub likeliest: Option<ObjectPose>,
    /// One standard deviation of its position, m; of the likeliest place, when it was not found.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub std_m: Option<f64>,
    /// One standard deviation of the likeliest place if it stands there at all, m, when it was not found.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub std_if_there_m: Option<f64>,
    /// One standard deviation of its turn, rad.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub yaw_std_rad: Option<f64>,
    /// Which of the two ways the pose came.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub way: Option<Way>,
    /// How far the two ways put the object apart, m; absent when the contour was of no use.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ways_apart_m: Option<f64>,
    /// What the mask is, where somebody else was asked for masks.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mask_is: Option<MaskIs>,
    /// Whether contour and key points are those of somebody else's mask, where somebody was asked.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub contour_is_offered: Option<bool>,
    /// How sure, 0 to 1.
    pub confidence: f64,
    /// What the picture says against the scene although the object is found.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ambiguous: Option<String>,
    /// Why it is not found.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
}

impl Answer {
    /// Words sightings as the answer; `mask_path` says where an object's mask was written, if it was.
    /// `is_offered` when somebody else was asked for masks.
    pub fn new(
        sightings: &[Sighting],
        is_offered: bool,
        mask_path: impl Fn(&Sighting) -> Option<String>,
    ) -> Self {
        let objects = sightings
            .iter()
            .map(|s| ObjectAnswer {
                name: s.name.clone(),
                found: s.found,
                mask: mask_path(s),
                bbox_px: (s.found || s.likeliest.is_some()).then_some(s.bbox),
                key_points_px: s.found.then(|| s.key_points.clone()),
                key_points_are: s.found.then_some(if s.checks.measured {
                    "measured"
                } else {
                    "projected"
                }),
                world_from_object: s.world_from_object,
                likeliest: s.likeliest,
                std_m: (s.found || s.likeliest.is_some()).then_some(s.std),
                std_if_there_m: s.likeliest.map(|_| s.std_if_there),
                yaw_std_rad: s.found.then_some(s.yaw_std),
                way: s.found.then_some(s.way),
                ways_apart_m: s.checks.apart.filter(|_| s.found),
                mask_is: is_offered.then_some(s.mask_is),
                contour_is_offered: is_offered.then_some(s.checks.is_others),
                confidence: s.confidence,
                ambiguous: s.ambiguous.clone(),
                reason: s.reason.clone(),
            })
            .collect();
        Self { objects }
    }
}
