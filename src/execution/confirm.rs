//! Whether things that were put down stand where they were put, by a photograph: independent of the hand that put them.
//!
//! A thing is gone only when nothing speaks for it: it is not found near its place, and the picture says that it is gone from
//! there ([`vision::Believed`]).

use std::collections::{BTreeMap, BTreeSet};

use image::{GrayImage, RgbImage};

use crate::alignment::vision::{self, Asks, Error, Options, Sighting};
use crate::world::{Camera, Scene, WorldState};

/// A thing found so near to where it was put stands there, m: what a hand may be off (8 to 19 mm in `docs/results.md`) and
/// a centimetre that things slide when they are let go.
const THERE: f64 = 0.03;

/// What a photograph is judged with.
pub(super) struct Confirmation<'a> {
    pub(super) photo: &'a RgbImage,
    pub(super) camera: &'a Camera,
    pub(super) scene: &'a Scene,
    /// How high some things stand, m.
    pub(super) raised: BTreeMap<String, f64>,
    /// What is known not to stand on the table.
    pub(super) elsewhere: BTreeSet<String>,
    /// Where the arm, with what is in the hand, is in the picture.
    pub(super) mask: &'a GrayImage,
    /// Whether somebody wants it to end.
    pub(super) stop: Asks<'a>,
}

/// What a photograph said.
pub(super) struct Judged {
    /// What is gone from where it is believed to stand.
    pub(super) gone: Vec<String>,
    /// Everything seen.
    pub(super) seen: Vec<Sighting>,
}

impl Confirmation<'_> {
    /// Returns the things of `names` that are gone from where they are believed to stand, and everything seen; `None` when
    /// it was stopped.
    ///
    /// # Errors
    ///
    /// [`Error::WrongSize`] when the picture is not the camera's size.
    pub(super) fn judge(
        &self,
        names: &[String],
        state: &WorldState,
    ) -> Result<Option<Judged>, Error> {
        let mut options = Options {
            ignore: Some(self.mask.clone()),
            raised: self.raised.clone(),
            elsewhere: self.elsewhere.clone(),
            ..Options::default()
        };
        let look = vision::Look::new(self.photo, self.camera, self.scene)?.until(self.stop);
        let seen = look.see_standing(&mut options, &state.objects);
        let mut gone = Vec::new();
        for name in names {
            let Some(object) = self.scene.object(name) else { continue };
            let Some(pose) = state.object(name).and_then(|known| known.world_from_object) else {
                continue;
            };
            let is_there = seen.iter().filter(|s| s.name == *name).any(|s| {
                let at = s.world_from_object.or(s.kept);
                at.is_some_and(|at| (at.origin() - pose.origin()).norm() < THERE)
            });
            let believed =
                vision::Believed { look: &look, objects: &state.objects, arm: Some(self.mask) };
            if !is_there && believed.is_gone(object, &pose) {
                gone.push(name.clone());
            }
        }
        Ok((!look.is_stopped()).then_some(Judged { gone, seen }))
    }
}
