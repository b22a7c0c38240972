//! What `trueup camera segment` prints.

use serde::Serialize;

use crate::alignment::segment::{By, Segment};

/// The answer of `camera segment`.
#[derive(Debug, Clone, Serialize)]
pub struct Answer {
    /// Whether anything was cut out.
    pub found: bool,
    /// Width and height of the picture, px.
    pub size_px: (u32, u32),
    /// What was cut out, what is most surely whole first.
    pub segments: Vec<SegmentAnswer>,
    /// What somebody else offered, if anybody was asked.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub masks: Option<Others>,
}

/// Masks that somebody else offered.
#[derive(Debug, Clone, Serialize)]
pub struct Others {
    /// Who.
    pub from: String,
    /// How many have an outline.
    pub came: usize,
    /// How much the best of them is the outline of a whole thing, 0 to 1.
    pub agreement: Option<f64>,
    /// The same of our own best.
    pub own_agreement: Option<f64>,
}

impl Others {
    /// Sets what somebody offered beside our own cuts.
    pub fn new(from: &str, own: &[Segment], theirs: &[Segment]) -> Self {
        let best = |cuts: &[Segment]| cuts.iter().map(|cut| cut.agreement).reduce(f64::max);
        Self {
            from: from.to_owned(),
            came: theirs.len(),
            agreement: best(theirs),
            own_agreement: best(own),
        }
    }
}

/// One thing cut out.
#[derive(Debug, Clone, Serialize)]
pub struct SegmentAnswer {
    /// Where its mask was written.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mask: Option<String>,
    /// Its box `[u0, v0, u1, v1]`, px.
    pub bbox_px: [f64; 4],
    /// Its area, px².
    pub area_px: usize,
    /// Its outer border, px, in order, closed.
    pub contour_px: Vec<[f64; 2]>,
    /// How well its outline runs along the picture's edges, 0 to 1.
    pub edge: f64,
    /// How much its outline is that of a whole thing, 0 to 1. It is no probability.
    pub agreement: f64,
    /// Whether its outline has no bites, spurs or ragged parts.
    pub is_smooth: bool,
    /// Who cut it out: `trueup`, or `masks` for whoever `--masks` names.
    pub by: &'static str,
    /// What its maker thinks of it, if that is somebody else.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub score: Option<f64>,
}

impl Answer {
    /// Words what was cut out as the answer; `masks` says where each mask was written, if they were.
    pub fn new(
        cuts: &[Segment],
        masks: &[String],
        size_px: (u32, u32),
        others: Option<Others>,
    ) -> Self {
        let segments = cuts
            .iter()
            .enumerate()
            .map(|(k, cut)| {
                let (bbox_px, area_px) = cut.extent();
                let (by, score) = match cut.by {
                    By::Ours => ("trueup", None),
                    By::Other { score } => ("masks", Some(score)),
                };
                SegmentAnswer {
                    mask: masks.get(k).cloned(),
                    bbox_px,
                    area_px,
                    contour_px: cut.contour.clone(),
                    edge: cut.edge,
                    agreement: cut.agreement,
                    is_smooth: cut.is_smooth,
                    by,
                    score,
                }
            })
            .collect();
        Self { found: !cuts.is_empty(), size_px, segments, masks: others }
    }
}
