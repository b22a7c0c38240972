//! What an action's script works with: the arm's joints, its fingers, the camera.
//!
//! Read off the words the script uses, without running it, so that `together` can be judged when a text is
//! checked. A script that only asks (`twin.…`) works with nothing.

use crate::language::script_words::{Part, words_of};
use crate::trace::Shared;

/// What something works with.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Uses {
    /// The arm's joints, moved or held still.
    pub joints: bool,
    /// The fingers.
    pub fingers: bool,
    /// The camera.
    pub camera: bool,
}

impl Uses {
    /// Reads the words of a script.
    pub fn of_script(text: &str) -> Self {
        let mut uses = Self::default();
        for code in code(text) {
            for handle in ["arm", "camera"] {
                for said in words_after(code, &format!("{handle}.")) {
                    let parts = words_of(handle).filter(|word| word.name == said);
                    for part in parts.flat_map(|word| word.works_with) {
                        match part {
                            Part::Joints => uses.joints = true,
                            Part::Fingers => uses.fingers = true,
                            Part::Camera => uses.camera = true,
                        }
                    }
                }
            }
        }
        uses
    }

    /// Returns what either works with.
    #[must_use]
    pub fn and(self, other: Self) -> Self {
        Self {
            joints: self.joints || other.joints,
            fingers: self.fingers || other.fingers,
            camera: self.camera || other.camera,
        }
    }

    /// Returns what both work with, `None` when they may go on at the same time.
    pub fn shared(self, other: Self) -> Option<Shared> {
        if self.joints && other.joints {
            Some(Shared::Arm)
        } else if self.fingers && other.fingers {
            Some(Shared::Fingers)
        } else if self.camera && other.camera {
            Some(Shared::Camera)
        } else {
            None
        }
    }

    /// Whether it works with nothing.
    pub fn is_nothing(self) -> bool {
        self == Self::default()
    }
}

/// Whether a script closes the fingers on something.
pub fn takes(script: &str) -> bool {
    code(script).any(|code| words_after(code, "arm.").any(|word| word == "close"))
}

/// Whether a script plans to pour.
pub fn pours(script: &str) -> bool {
    code(script).any(|code| words_after(code, "twin.").any(|word| word == "pours"))
}

/// Whether a script says a word: reads the parameter of that name, for one.
pub fn says(script: &str, word: &str) -> bool {
    let is_of_word = |c: char| c.is_alphanumeric() || c == '_';
    code(script).any(|code| {
        code.match_indices(word).any(|(at, _)| {
            !code[..at].ends_with(is_of_word) && !code[at + word.len()..].starts_with(is_of_word)
        })
    })
}

/// Returns the lines of a script without their comments.
fn code(script: &str) -> impl Iterator<Item = &str> {
    script.lines().map(|line| line.split("//").next().unwrap_or_default())
}

/// The words that follow `handle` in a line of a script.
fn words_after<'a>(code: &'a str, handle: &'a str) -> impl Iterator<Item = &'a str> {
    code.match_indices(handle).filter_map(move |(at, _)| {
        let is_inside = code[..at].ends_with(|c: char| c.is_alphanumeric() || c == '_');
        let rest = &code[at + handle.len()..];
        let end = rest.find(|c: char| !(c.is_alphanumeric() || c == '_')).unwrap_or(rest.len());
        (!is_inside && end > 0).then_some(&rest[..end])
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_read_and_notes_are_not() {
        let moves = Uses::of_script("// arm.open();\nlet p = recall(\"p\");\narm.follow(p, 0.4);");
        assert_eq!(moves, Uses { joints: true, ..Uses::default() });
        let opens = Uses::of_script("arm.open();\nlet wide = arm.opening();");
        assert_eq!(opens, Uses { fingers: true, ..Uses::default() });
        let closes = Uses::of_script("arm.close(o, 40.0 * N);");
        assert_eq!(closes, Uses { joints: true, fingers: true, camera: false });
        assert_eq!(Uses::of_script("camera.look();"), Uses { camera: true, ..Uses::default() });
        assert!(Uses::of_script("let alarm.move_to = 1;").is_nothing());
        assert_eq!(moves.shared(closes), Some(Shared::Arm));
        assert_eq!(moves.shared(opens), None);
        assert!(moves.and(opens).fingers);
    }

    #[test]
    fn a_word_is_said_as_a_whole_and_outside_of_comments() {
        let script = "// at the table\nlet spot = choose(twin.placements(o)); attach(what);";
        assert!(says(script, "o") && says(script, "spot"));
        assert!(!says(script, "at") && !says(script, "table"));
    }
}
