//! Why a search found no path, told of what a person can change.

use crate::motion::Error;
use crate::trace::{Tilted, TooNear, Why};

use super::Planner;

impl Planner {
    /// Why a search found no path. All around is taken for larger by as much as the arm is in doubt; what is told are the
    /// distances that there are.
    pub(super) fn why_no_path(&self, error: Error) -> Why {
        let held = self.state.held.as_deref();
        if let Some(why) = held.and_then(|held| self.why_with(held, &error)) {
            return why;
        }
        let is_grown = |name: &str| !self.is_arm(name) && held != Some(name);
        match error {
            Error::Collision { which, first, second, depth, margin }
                if self.doubt > 0.0 && is_grown(&second) =>
            {
                let kept = margin + self.doubt;
                let apart = kept - depth;
                Why::TooNear(Box::new(TooNear { which, first, second, apart, kept }))
            }
            other => other.into(),
        }
    }

    /// Why a search found no path, where that is for what is in the hand, which nobody has to move out of the way.
    fn why_with(&self, held: &str, error: &Error) -> Option<Why> {
        let held_name = held.to_owned();
        match error {
            Error::Tilted { which, angle, max_angle } if which == "start" => {
                let scene = &self.cell.scene;
                let is_vessel = scene.object(held).is_some_and(|object| object.cavity.is_some())
                    && scene.drawer(held).is_none();
                let (angle, most) = (*angle, *max_angle);
                Some(Why::Tilted(Tilted { held: held_name, is_vessel, angle, most }))
            }
            Error::Collision { first, second, .. }
                if (first == held && self.is_arm(second))
                    || (second == held && self.is_arm(first)) =>
            {
                Some(Why::IntoHeld { held: held_name, says: error.to_string() })
            }
            _ => None,
        }
    }

    /// Whether a part of what may collide is the arm's own.
    fn is_arm(&self, part: &str) -> bool {
        self.robot().link(part).is_ok()
    }
}

impl From<Error> for Why {
    fn from(error: Error) -> Self {
        match error {
            Error::Cancelled => Self::Stopped,
            Error::Spent { seconds } => Self::NotWithin(seconds),
            other => Self::NoPath(other.to_string()),
        }
    }
}
