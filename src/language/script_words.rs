//! The words of action scripts: how each is written, what it works with, and what it does.
//!
//! One table for all: the engine binds what stands here (`execution::words`), `together` is checked by what a word works
//! with (`execution::uses`), `trueup doc` and `?name` show it, and the list in `docs/language.md` is written from it.
//! `tests/language/script_words.rs` holds the engine and the document to it. Nothing is done here.

use std::fmt::Write as _;

/// What a word works with, so that two things at the same time cannot both want it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// The arm's joints, moved or held still.
    Joints,
    /// The fingers.
    Fingers,
    /// The camera.
    Camera,
}

/// One word.
#[derive(Debug, Clone, Copy)]
pub struct ScriptWord {
    /// What it is a word of: `arm`, `twin`, `camera`, a value such as `grasp`; nothing when it stands alone.
    pub of: &'static str,
    /// Its name.
    pub name: &'static str,
    /// Its arguments; `None` for what is read without a call.
    pub takes: Option<&'static str>,
    /// What it works with.
    pub works_with: &'static [Part],
    /// What it does, in a line.
    pub does: &'static str,
}

const NOTHING: &[Part] = &[];
const JOINTS: &[Part] = &[Part::Joints];
const FINGERS: &[Part] = &[Part::Fingers];
const BOTH: &[Part] = &[Part::Joints, Part::Fingers];
const CAMERA: &[Part] = &[Part::Camera];

const fn of(
    of: &'static str,
    name: &'static str,
    takes: &'static str,
    works_with: &'static [Part],
    does: &'static str,
) -> ScriptWord {
    ScriptWord { of, name, takes: Some(takes), works_with, does }
}

const fn twin(name: &'static str, takes: &'static str, does: &'static str) -> ScriptWord {
    of("twin", name, takes, NOTHING, does)
}

const fn arm(
    name: &'static str,
    takes: &'static str,
    works_with: &'static [Part],
    does: &'static str,
) -> ScriptWord {
    of("arm", name, takes, works_with, does)
}

const fn part(of: &'static str, name: &'static str, does: &'static str) -> ScriptWord {
    ScriptWord { of, name, takes: None, works_with: NOTHING, does }
}

/// Every word there is, in the order of a help page.
pub const WORDS: &[ScriptWord] = &[
    of("camera", "look", "", CAMERA, "takes a camera image, and what it shows for what is there"),
    twin("grasps", "o, face, pitch", "ways to take `o`, best first; of a drawer, its handle"),
    part("grasp", "before", "joint positions before the thing"),
    part("grasp", "way_in", "the path from there to between the fingers"),
    part("grasp", "way_out", "the same path back"),
    part("grasp", "clearance", "the smallest distance to anything on the way, m"),
    part("grasp", "face", "`\"side\"` or `\"top\"`"),
    part("grasp", "heading", "where the hand points as seen from above, rad in the world"),
    twin("pours", "o, target, clearance", "ways to pour from `o` in the hand, best first"),
    part("pour", "start", "joint positions with the lip in place"),
    part("pour", "turn", "the path that pours"),
    part("pour", "back", "the same path back"),
    part("pour", "clearance", "the smallest distance to anything, m"),
    of(
        "pour",
        "runs_on",
        "share, rate",
        NOTHING,
        "how many m³ still stand above the lip at a share of the turn when water leaves at so many m³/s, as over a \
         weir: what will run on",
    ),
    of(
        "pour",
        "share_holding",
        "volume",
        NOTHING,
        "the share of its `turn` at which the vessel, full to its lip, holds so many m³, by its shape",
    ),
    twin(
        "placements",
        "o, at",
        "ways to put `o` down on `at`: `\"table\"`, another thing, into a vessel, or a place such as `left_of(cup)` that \
         came as an argument; best first",
    ),
    twin(
        "turned_placements",
        "o",
        "ways to put down `o`, held from above, on a free place of the table, turned so that a level hand can take it there; \
         best first",
    ),
    part("placement", "above", "joint positions above the place"),
    part("placement", "way_down", "the path down to it"),
    part("placement", "way_out", "the path away with open fingers"),
    part("placement", "at", "where the thing will stand, `[x, y, z]` in m"),
    twin(
        "pushes",
        "o, at",
        "ways to push `o` along what it stands on, with the fingers as far open as they are, to a place such as \
         `left_of(cup)`; best first",
    ),
    part(
        "push",
        "legs",
        "its straight pushes, one after the other; none where it is there already",
    ),
    part("leg", "before", "joint positions above and behind the thing"),
    part("leg", "way_in", "the path down behind it"),
    part("leg", "way_out", "the path back from it and up"),
    twin(
        "stirs",
        "tool, vessel",
        "ways to stir a vessel's water with what is in the hand, best first",
    ),
    part("stir", "above", "joint positions with the tip over the vessel"),
    part("stir", "way_in", "the path down into the water"),
    part("stir", "way_out", "the same path back"),
    part("stir", "round", "the path three times round in it"),
    twin("wipes", "o", "ways to wipe the top of `o` with closed fingers, in strokes side by side"),
    part("wipe", "strokes", "its strokes in order"),
    part("wipe", "hover", "how far above the top each begins, m"),
    part("stroke", "before", "joint positions above its beginning"),
    part("stroke", "along", "the path along it, where the top is thought to be"),
    part("stroke", "way_out", "the path up from its end"),
    twin(
        "reach",
        "pose",
        "joint positions that bring the tool to a pose and touch nothing, nearest first; fails when there are none",
    ),
    twin("pose_named", "name", "joint positions of a pose in `robot.toml`"),
    twin("position", "o", "where the middle of the base of `o` is, `[x, y, z]` in m"),
    twin("turned", "o", "how `o` is turned about the vertical, rad"),
    twin("size", "o", "the box that `o` fills when it stands, `[x, y, z]` in m"),
    twin("volume", "o", "water in `o`, m³"),
    twin(
        "enough",
        "o, volume",
        "whether `o` holds so many m³ by now; on the arm, what the rehearsal said at this point",
    ),
    twin(
        "drips",
        "o",
        "whether water clings to the lip of `o`; on the arm, what the rehearsal said at this point",
    ),
    twin(
        "handings",
        "o",
        "joint positions that hold `o`, which is in the hand, out where the scene has the person, nearest first",
    ),
    twin("drawn", "o", "how far the drawer `o` is drawn, m"),
    twin("travel", "o", "how far the drawer `o` can be drawn, m"),
    twin("squeeze", "o", "the force in N with which `o` is held, with what is in it"),
    of(
        "",
        "pose",
        "at, heading, pitch",
        NOTHING,
        "a pose of the tool: at `[x, y, z]` m, pointing along `heading` as seen from above and `pitch` down, both rad",
    ),
    part("pose", "at", "its place, `[x, y, z]` in m"),
    part("pose", "heading", "where the tool points as seen from above, rad"),
    part("pose", "pitch", "how far the tool points down, rad"),
    of("pose", "moved", "by", NOTHING, "the pose `[x, y, z]` m from there, turned alike"),
    of(
        "pose",
        "turned",
        "axis, angle",
        NOTHING,
        "the pose in that place, turned about an axis of the world by `angle` rad",
    ),
    of(
        "",
        "choose",
        "ways",
        NOTHING,
        "one of them: the best in the first simulation, others in others, and on the arm the one of the plan that succeeded",
    ),
    of("", "remember", "name, value", NOTHING, "keeps a value for a later action"),
    of("", "recall", "name", NOTHING, "the value that an earlier action kept"),
    arm(
        "move_to",
        "q",
        JOINTS,
        "to joint positions, or with the tool to a pose, round everything in the way",
    ),
    arm(
        "carry_to",
        "q, tilt, speed",
        JOINTS,
        "the same with what is held within `tilt` rad of upright, at a part of full speed",
    ),
    arm("follow", "path, speed", JOINTS, "along a path, at a part of full speed"),
    arm(
        "move_by",
        "by, speed",
        JOINTS,
        "a straight line of the tool by `[x, y, z]` m in the world that touches nothing",
    ),
    arm(
        "line_to",
        "pose, speed",
        JOINTS,
        "a straight line of the tool to a pose that touches nothing; the tool turns on the way",
    ),
    arm(
        "turn_about",
        "axis, angle",
        JOINTS,
        "turns the tool about an axis of the world through the point between the fingers, by `angle` rad, touching \
         nothing, at 30 deg/s",
    ),
    arm(
        "move_until",
        "by, force",
        JOINTS,
        "a straight line by `[x, y, z]` m, slowly, until the joints feel `force` N against it; returns how far it went, m, \
         and fails when nothing is felt. Fingers and what they hold may touch",
    ),
    arm(
        "pull",
        "by, force",
        JOINTS,
        "a straight line by `[x, y, z]` m at 3 cm/s that ends where the joints feel `force` N against it, or with its way; \
         returns how far it went, m. Fingers and what they hold may touch",
    ),
    arm("push", "leg", JOINTS, "forward to the thing and with it, at 5 cm/s"),
    arm(
        "rise",
        "by, speed",
        JOINTS,
        "straight up by `by` m, or by as much of it as the arm can follow without touching anything",
    ),
    arm(
        "raise",
        "by, least, speed",
        JOINTS,
        "straight up by `by` m, touching nothing, or where the arm cannot follow that by less, `least` m at least",
    ),
    arm(
        "draw_back",
        "path, speed",
        JOINTS,
        "that path; a hand above where it begins, as in a lift that was cut short, is brought down there first",
    ),
    arm("turn", "path, rate", JOINTS, "along a path that turns the hand, at `rate` rad/s"),
    arm("turn_back", "path, rate", JOINTS, "what was turned, back"),
    arm(
        "turn_to",
        "path, share, rate",
        JOINTS,
        "along such a path from wherever the hand is on it, to this share of it",
    ),
    arm("open", "", FINGERS, "the fingers as wide as they go"),
    arm("open_to", "width", FINGERS, "the fingers to so many m between the pads"),
    // Before the fingers close, the empty hand is weighed, for which the arm holds still.
    arm("close", "o, force", BOTH, "the fingers on `o`, with at most `force` N"),
    arm(
        "heft",
        "seconds",
        JOINTS,
        "mass in the hand, kg, from the joint torques, averaged so long at rest",
    ),
    arm(
        "stands",
        "o",
        JOINTS,
        "whether `o`, believed to hang more than 4 mm above what is below it, has slid in the hand and stands: then the \
         joints feel the arm press on it",
    ),
    arm(
        "weighed",
        "mass",
        NOTHING,
        "so much is in the hand now, and what is missing went into what is below",
    ),
    arm("bears", "mass", NOTHING, "so much is in the hand, and was in it all along"),
    arm("weigh", "", JOINTS, "`arm.weighed(arm.heft(0.5))`"),
    arm(
        "offer",
        "o, force, seconds",
        JOINTS,
        "holds `o` out still until somebody pulls at it with `force` N for 0.2 s; returns after how many s, and fails when \
         nobody does within `seconds`. The fingers stay closed",
    ),
    arm("wait", "seconds", JOINTS, "holds still"),
    arm("opening", "", NOTHING, "between the pads, m, as measured"),
    arm("joints", "", NOTHING, "joint positions, rad, as measured"),
    arm("torques", "", NOTHING, "joint torques, N·m, as measured"),
    arm("pose", "", NOTHING, "where the plan has the tool now, as a pose"),
    of(
        "",
        "note",
        "text",
        NOTHING,
        "tells whoever watches the arm, in its events and on stderr, at most 400 characters of each and 100 of a script; \
         `print` does the same",
    ),
];

impl ScriptWord {
    /// Returns how it is written: `arm.close(o, force)`, `grasp.heading`, `choose(ways)`.
    pub fn written(&self) -> String {
        let mut written = self.full_name();
        if let Some(takes) = self.takes {
            let _ = write!(written, "({takes})");
        }
        written
    }

    /// Returns its name with what it is a word of: `arm.close`.
    pub fn full_name(&self) -> String {
        if self.of.is_empty() { self.name.into() } else { format!("{}.{}", self.of, self.name) }
    }
}

/// Returns the words of a handle, or of a value, or those that stand alone when `of` is empty.
pub fn words_of(of: &str) -> impl Iterator<Item = &'static ScriptWord> {
    WORDS.iter().filter(move |word| word.of == of)
}

/// Returns what a name means in scripts, as lines of text: `arm.close`, or `arm` for all its words, or a bare name.
pub fn describe(name: &str) -> Option<String> {
    let found: Vec<_> = match name.split_once('.') {
        Some((of, name)) => words_of(of).filter(|word| word.name == name).collect(),
        None if name.is_empty() => Vec::new(),
        None => WORDS.iter().filter(|word| word.of == name || word.name == name).collect(),
    };
    let said: Vec<_> = found
        .iter()
        .map(|word| format!("{}\n  {}\n  a word of action scripts", word.written(), word.does))
        .collect();
    (!said.is_empty()).then(|| said.join("\n"))
}

/// Returns the list of words as a table in Markdown.
pub fn table() -> String {
    let mut table = String::from("| word | does |\n|---|---|\n");
    for word in WORDS {
        let _ = writeln!(table, "| `{}` | {} |", word.written(), word.does);
    }
    table
}
