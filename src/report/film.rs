//! A run as a film: camera beside twin, and below them the step, the fluents as measured, and the twin's water over
//! time. One picture of the film for each moment of the run folder's, so it plays at the arm's own speed
//! where that was filmed often, and two and a half times as fast where nobody waited for it.
//!
//! A run that was not filmed shows the pictures after its steps, a second each. Files are read by whoever calls.

use image::{Rgb, RgbImage, imageops};

use crate::film::{Film, letters};
use crate::trace::StepRecord;
use crate::workcell::Run;
use crate::workcell::film as reel;

use super::Style;
use super::course::COLOURS;
use super::run::ending;

/// What is said of a film in which no picture is the camera's.
pub const ONLY_THE_TWIN: &str = "only the twin is shown: the camera was not filmed in this run. A camera behind a bridge is filmed with \
    `--live`; where the bridge goes in real time, a camera that `--camera-at URL` names is";

/// Pictures a second, Hz: as a run that is watched is filmed.
const RATE: u32 = 5;
/// Width and height of one of the two pictures, px.
const PICTURE: (u32, u32) = (480, 270);
/// Width and height of the film, px.
const SIZE: (u32, u32) = (2 * PICTURE.0, PICTURE.1 + 162);
/// How long the end is shown, in pictures.
const END: usize = 15;
/// Fluents that there is room for.
const FLUENTS: usize = 10;

/// Vessels whose water there is room for.
const VESSELS: usize = 4;

/// Colours of the dark page, and of the water in vessels: those of the drawings in a report, in their order, as light as dark
/// paper asks for.
const PAPER: [u8; 3] = [20, 23, 26];
const INK: [u8; 3] = [231, 233, 235];
const SOFT: [u8; 3] = [163, 172, 181];
const LINE: [u8; 3] = [58, 64, 71];
const YES: [u8; 3] = [127, 214, 160];
const NO: [u8; 3] = [255, 157, 147];
const WATER: [[u8; 3]; COLOURS.len()] = [
    [92, 146, 235],
    [230, 159, 0],
    [60, 190, 145],
    [232, 110, 50],
    [120, 200, 245],
    [214, 140, 185],
    [163, 172, 181],
];

/// Which picture of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Seen {
    /// Of a moment of its film, by number.
    Moment(usize),
    /// After a step, by number.
    After(usize),
}

/// What of a run folder is shown.
pub struct Material<'a> {
    /// The run.
    pub run: &'a Run,
    /// The table of its film.
    pub film: &'a reel::Film,
    /// Returns a picture: of the camera (`real`) or the `twin`.
    pub picture: &'a dyn Fn(Seen, &str) -> Option<RgbImage>,
}

/// A moment that is shown.
struct Moment {
    seen: Seen,
    time: f64,
    step: usize,
    water_ml: Vec<f64>,
}

/// Returns the film of a run as an MP4 file; `None` when the run has no pictures.
pub fn mp4(material: &Material<'_>) -> Option<Vec<u8>> {
    let moments = moments(material);
    let mut film = Film::new(SIZE.0, SIZE.1, RATE);
    let mut last = None;
    for at in 0..moments.len() {
        let canvas = frame(material, &moments, at);
        let times = if material.film.moments.is_empty() { RATE as usize } else { 1 };
        for _ in 0..times {
            film.add(&canvas);
        }
        last = Some(canvas);
    }
    let mut end = last?;
    let words = ending(material.run, Style::plain());
    let colour = if words.starts_with("done") { YES } else { NO };
    let line = words.lines().next().unwrap_or_default();
    let water = words.lines().find(|line| line.starts_with("  water")).unwrap_or_default();
    band(&mut end, &format!("{line} {water}"), colour);
    for _ in 0..END {
        film.add(&end);
    }
    Some(film.finish())
}

/// The moments that are shown: those of the film, or the ends of the steps.
fn moments(material: &Material<'_>) -> Vec<Moment> {
    if material.film.moments.is_empty() {
        let steps = material.run.steps.iter();
        let steps = steps.map(|step| Moment {
            seen: Seen::After(step.number),
            time: step.interval_s[1],
            step: step.number,
            water_ml: Vec::new(),
        });
        return steps.filter(|moment| (material.picture)(moment.seen, "twin").is_some()).collect();
    }
    let all = material.film.moments.iter();
    all.map(|moment| Moment {
        seen: Seen::Moment(moment.number),
        time: moment.time,
        step: moment.step,
        water_ml: moment.water_ml.clone(),
    })
    .collect()
}

/// One picture of the film.
fn frame(material: &Material<'_>, moments: &[Moment], at: usize) -> RgbImage {
    let moment = &moments[at];
    let mut canvas = RgbImage::from_pixel(SIZE.0, SIZE.1, Rgb(PAPER));
    for (x, whose, word) in [(0, "real", "camera"), (PICTURE.0, "twin", "twin")] {
        match (material.picture)(moment.seen, whose) {
            Some(picture) => imageops::replace(&mut canvas, &fitted(picture), i64::from(x), 0),
            None => letters::write(&mut canvas, (x + 12, 120), "no picture", SOFT),
        }
        block(&mut canvas, (x + 8, 8), (word.len() as u32 * letters::CELL.0 + 12, 22), PAPER);
        letters::write(&mut canvas, (x + 14, 10), word, INK);
    }
    let record = material.run.steps.iter().find(|step| step.number == moment.step);
    let action = record.map_or("", |step| step.action.as_str());
    let step = format!("step {} of {}  {action}", moment.step, material.run.steps.len());
    letters::write(&mut canvas, (16, PICTURE.1 + 10), &cut(&step, 64), INK);
    let begin = moments.first().map_or(0.0, |first| first.time);
    let time = format!("{:5.1} s", moment.time - begin);
    letters::write(&mut canvas, (600, PICTURE.1 + 10), &time, SOFT);
    fluents(&mut canvas, &material.run.steps, moment);
    water(&mut canvas, material, moments, at);
    canvas
}

/// Brings a picture to its size.
fn fitted(picture: RgbImage) -> RgbImage {
    if picture.dimensions() == PICTURE {
        return picture;
    }
    imageops::thumbnail(&picture, PICTURE.0, PICTURE.1)
}

/// When the fluents were measured that are shown beside step `at`: what goes on changes some of them, and is measured at
/// its end. `last` is the last step that has ended.
fn heading(last: Option<usize>, at: usize) -> &'static str {
    if last.is_some_and(|last| last >= at) {
        "as measured after this step:"
    } else {
        "as measured before this step:"
    }
}

/// What was measured last of each fluent that the run changed.
fn fluents(canvas: &mut RgbImage, steps: &[StepRecord], moment: &Moment) {
    let mut names: Vec<&str> = Vec::new();
    let known = |step: &StepRecord, name: &str| {
        step.fluents.iter().find(|row| row.name == name).and_then(|row| row.measured)
    };
    for step in steps {
        for row in &step.fluents {
            let changes = steps.windows(2).any(|two| {
                let (a, b) = (known(&two[0], &row.name), known(&two[1], &row.name));
                a.is_some() && b.is_some() && a != b
            });
            if changes && !names.contains(&row.name.as_str()) {
                names.push(&row.name);
            }
        }
    }
    let before = steps.iter().take_while(|step| step.interval_s[1] <= moment.time + 1e-3).last();
    if !names.is_empty() {
        let words = heading(before.map(|step| step.number), moment.step);
        letters::write(canvas, (16, PICTURE.1 + 30), words, SOFT);
    }
    for (n, name) in (0_u32..).zip(names.into_iter().take(FLUENTS)) {
        let (x, y) = (16 + n % 2 * 310, PICTURE.1 + 50 + n / 2 * 20);
        let truth = before.and_then(|step| known(step, name));
        let (mark, ink) = match truth {
            Some(true) => (YES, INK),
            Some(false) => (LINE, SOFT),
            None => (PAPER, SOFT),
        };
        block(canvas, (x, y + 4), (11, 11), SOFT);
        block(canvas, (x + 1, y + 5), (9, 9), mark);
        letters::write(canvas, (x + 19, y), &cut(name, 31), ink);
    }
}

/// The water in the twin's vessels up to this moment.
fn water(canvas: &mut RgbImage, material: &Material<'_>, moments: &[Moment], at: usize) {
    let most =
        moments.iter().flat_map(|moment| moment.water_ml.iter()).fold(0.0_f64, |a, b| a.max(*b));
    if most < 1.0 {
        return;
    }
    let (left, top, width, height) = (700, PICTURE.1 + 34, 244, 112);
    letters::write(canvas, (left, PICTURE.1 + 10), "water in the twin, mL", SOFT);
    block(canvas, (left, top + height), (width, 1), LINE);
    let (first, last) = (moments[0].time, moments[moments.len() - 1].time);
    let span = (last - first).max(1e-6);
    let column = |time: f64| left + ((time - first) / span * f64::from(width - 96)) as u32;
    let row = |ml: f64| top + height - (ml.clamp(0.0, most) / most * f64::from(height - 14)) as u32;
    let mut free = top;
    let named = material.film.vessels.iter().enumerate();
    let mut shown: Vec<(usize, &String)> = named
        .filter(|(k, name)| {
            *name != "spilt" || moments.iter().any(|moment| moment.water_ml[*k] >= 0.5)
        })
        .take(VESSELS)
        .collect();
    // The fullest is labelled first, the others below it.
    shown.sort_by(|a, b| moments[at].water_ml[b.0].total_cmp(&moments[at].water_ml[a.0]));
    for (k, name) in shown {
        let colour = WATER[k % WATER.len()];
        for two in moments[..=at].windows(2) {
            let (a, b) = (row(two[0].water_ml[k]), row(two[1].water_ml[k]));
            for x in column(two[0].time)..=column(two[1].time) {
                block(canvas, (x, a.min(b)), (1, a.abs_diff(b).max(2)), colour);
            }
        }
        let ml = moments[at].water_ml[k];
        let y = (row(ml).saturating_sub(9)).max(free);
        let label = format!("{} {ml:.0}", cut(name, 6));
        letters::write(canvas, (column(moments[at].time) + 6, y), &label, colour);
        free = y + letters::CELL.1;
    }
}

/// One line across the pictures.
fn band(canvas: &mut RgbImage, line: &str, colour: [u8; 3]) {
    let y = PICTURE.1 - 40;
    block(canvas, (0, y), (SIZE.0, 40), PAPER);
    letters::write(canvas, (16, y + 11), &cut(line, 102), colour);
}

fn block(canvas: &mut RgbImage, (x, y): (u32, u32), (width, height): (u32, u32), colour: [u8; 3]) {
    for (x, y) in (y..y + height).flat_map(|y| (x..x + width).map(move |x| (x, y))) {
        if let Some(pixel) = canvas.get_pixel_mut_checked(x, y) {
            *pixel = Rgb(colour);
        }
    }
}

/// A line of at most so many letters.
fn cut(line: &str, most: usize) -> String {
    if line.chars().count() <= most {
        return line.to_owned();
    }
    line.chars().take(most.saturating_sub(1)).chain(['…']).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Through all of a tilt the jar was told to be level, and not to pour.
    #[test]
    fn while_a_step_goes_on_the_fluents_are_told_to_be_those_before_it() {
        assert_eq!(heading(None, 1), "as measured before this step:");
        assert_eq!(heading(Some(7), 8), "as measured before this step:");
        assert_eq!(heading(Some(8), 8), "as measured after this step:");
    }

    /// The jar was yellow and the cup blue, which in the report was the jar.
    #[test]
    fn the_water_of_a_vessel_has_the_hue_that_it_has_in_the_report() {
        for (light, colour) in WATER.iter().zip(COLOURS) {
            let number = u32::from_str_radix(&colour[1..], 16).unwrap();
            let [_, dark @ ..] = number.to_be_bytes();
            let most = |of: &[u8; 3]| (0..3).max_by_key(|k| of[*k]);
            assert_eq!(most(light), most(&dark), "{colour}");
        }
    }
}
