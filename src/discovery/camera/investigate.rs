//! From files of points to a finding: tells noise and wrong matches, searches, answers.

use super::bent::Bent;
use super::camera_finding::answer;
use super::explain::CameraGap;
use super::layout::{LEAST, LEAST_IN_VIEW, laid_out};
use super::misread::misread;
use super::points::Points;
use super::term::Law;
use super::views::Data;
use super::{error, pictures, robust, wording};
use crate::discovery::finding::{SIGNIFICANT, above_noise};
use crate::discovery::recording::Error;
use crate::discovery::selection::{self, Diverged, Hypothesis, Outcome, Residuals as _, Set};
use crate::discovery::why::{Left, Seen, Shows, State, whys};
use crate::discovery::{Investigation, Options, Trace, by_channel};
use crate::language::ast::EffectItem;
use crate::world::Camera;

/// So many laws come in forms with more and fewer numbers that more of them must be fitted than of an arm.
const SHORTLIST: usize = 18;

/// Finds what the model of a camera lacks. Of several files the last is held out; of one, its last views, its last
/// stretch of time, or, where it has neither, rows spread over the picture.
///
/// `nominal` is the camera of the model, for files that say nothing of their own; `known` are the effects the model
/// has already.
///
/// # Errors
///
/// An [`Error`] for points without a camera, behind it or too few, and for effects that cannot be read.
pub fn investigate(
    files: &[Points],
    nominal: Option<&Camera>,
    known: &[EffectItem],
    options: &Options,
    progress: &mut dyn FnMut(&str, f64),
) -> Result<Investigation, Error> {
    progress(wording::LAYING_OUT, 0.0);
    let mut notes: Vec<String> = files.iter().flat_map(|file| file.notes.clone()).collect();
    let known = known_laws(known, &mut notes)?;
    let mut data = laid_out(files, nominal, options.holdout, &mut notes)?;
    if let Some(misread) = misread(&data, (&known.0, &known.1)) {
        return Err(error::misread(misread, &files[0].name));
    }
    progress(wording::TELLING_NOISE, 0.05);
    clean(&mut data, (&known.0, &known.1), files, &mut notes)?;
    let mut gap = CameraGap { data, known };
    let place = files[0].name.clone();
    let diverged = |what: Diverged| error::unfitted(what.to_string(), &place);
    let search = selection::Options { shortlist: SHORTLIST, ..options.search };
    let mut outcome = selection::search(&gap, &search, progress).map_err(diverged)?;
    if outcome.best.terms.is_empty()
        && above_noise(outcome.nothing.train, gap.count(Set::Train)) < SIGNIFICANT
        && above_noise(outcome.nothing.heldout, gap.count(Set::Heldout)) > SIGNIFICANT
    {
        // The points to fit do not show it, the others do: exchange the two.
        for sight in &mut gap.data.sights {
            sight.set = if sight.set == Set::Train { Set::Heldout } else { Set::Train };
        }
        gap.data.set_aside(LEAST_IN_VIEW);
        outcome = selection::search(&gap, &search, progress).map_err(diverged)?;
        notes.push(wording::ROLES_EXCHANGED.into());
    }
    let is_shift = |law: &Law| law.name() == "camera_shift";
    if gap.known.0.iter().any(is_shift) && outcome.best.terms.iter().any(is_shift) {
        notes.push(wording::shifted_again());
    }
    progress("writing the answer", 0.98);
    let traces = traces(&gap, &outcome.best, files);
    let whys = whys(&gap, &outcome, search.tie);
    let mut finding = answer(&gap, &outcome, &search, notes);
    let mut experiment = None;
    if let Some(next) = &mut finding.next_experiment {
        let (words, table) = settled(&gap, &outcome, &search);
        next.why.push_str("; ");
        next.why.push_str(&words);
        experiment = table;
    }
    by_channel(&mut finding, &traces);
    Ok(Investigation { finding, traces, whys, experiment, revision: None })
}

fn known_laws(
    known: &[EffectItem],
    notes: &mut Vec<String>,
) -> Result<(Vec<Law>, Vec<f64>), Error> {
    let mut laws = (Vec::new(), Vec::new());
    for effect in known {
        let read = super::known::known(effect).map_err(|bad| {
            let here = format!("effect {}({})", effect.name.text, effect.at.text);
            error::not_an_effect(&bad, here)
        })?;
        match read {
            Some((law, values)) => {
                laws.0.push(law);
                laws.1.extend(values);
            }
            None => notes.push(wording::not_of_camera(effect)),
        }
    }
    Ok(laws)
}

/// Tells the noise and leaves wrong matches out.
fn clean(
    data: &mut Data,
    known: (&[Law], &[f64]),
    files: &[Points],
    notes: &mut Vec<String>,
) -> Result<(), Error> {
    let name = &files[0].name;
    let told = robust::tell(data, known).map_err(|why| error::not_fitted(&why, name))?;
    let given = files.iter().find_map(|file| file.known.noise_px);
    data.sigma_given = given.is_some();
    data.sigma =
        given.or(told.sigma).ok_or_else(|| error::noise_unknown(data.sights.len(), name))?;
    if given.is_none() {
        notes.push(wording::noise_estimated(data.sigma));
    }
    if !told.wrong.is_empty() {
        let lines: Vec<String> = told
            .wrong
            .iter()
            .take(8)
            .map(|at| {
                let sight = &data.sights[*at];
                format!("{}:{}", files[sight.file].name, sight.line)
            })
            .collect();
        notes.push(wording::left_out(told.wrong.len(), data.sights.len(), &lines));
    }
    if !data.posed {
        let groups: Vec<usize> = Set::ALL
            .iter()
            .flat_map(|set| data.groups(*set))
            .filter(|(_, sights)| sights.len() < LEAST_IN_VIEW)
            .flat_map(|(_, sights)| sights)
            .collect();
        for at in groups {
            data.sights[at].wrong = true;
        }
    }
    if data.count(Set::Train) < LEAST || data.count(Set::Heldout) < 2 {
        return Err(error::too_few_left(name));
    }
    Ok(())
}

/// Says what would settle the first doubt, with the table of poses where there is one.
fn settled(
    gap: &CameraGap,
    outcome: &Outcome<Law>,
    options: &selection::Options,
) -> (String, Option<String>) {
    let timed = |law: &Law| matches!(law, Law::Delay | Law::Shutter);
    let rival = outcome.rivals.iter().find(|rival| {
        let chosen = outcome.best.terms[rival.instead_of];
        rival.behind < options.tie
            && rival.hypothesis.terms.last().is_some_and(|law| law.name() != chosen.name())
    });
    let Some(rival) = rival else { return (String::new(), None) };
    let pair = [Some(&outcome.best.terms[rival.instead_of]), rival.hypothesis.terms.last()];
    if pair.into_iter().flatten().any(timed) {
        return (wording::FILM.into(), None);
    }
    match pictures::settle(gap, [&outcome.best, &rival.hypothesis]) {
        Some(found) => (wording::flat_target(&found.words, found.separation), Some(found.csv)),
        None if gap.data.posed => (wording::BY_OTHER_MEANS.into(), None),
        None => (wording::TILTED.into(), None),
    }
}

/// Returns measured minus model before and after, a channel and file and set each.
fn traces(gap: &CameraGap, best: &Hypothesis<Law>, files: &[Points]) -> Vec<Trace> {
    let data = &gap.data;
    let bents: [Bent; 2] = [gap.bent(&[], &[]), gap.bent(&best.terms, &best.parameters)];
    let mut found = Vec::new();
    for set in Set::ALL {
        let Some(mut before) = data.residuals(&bents[0], set) else { continue };
        let Some(mut after) = data.residuals(&bents[1], set) else { continue };
        before.sort_by_key(|(at, _)| *at);
        after.sort_by_key(|(at, _)| *at);
        for (at, file) in files.iter().enumerate() {
            for (axis, channel) in ["u", "v"].into_iter().enumerate() {
                let of_file = |all: &[(usize, nalgebra::Vector2<f64>)]| -> Vec<(usize, f64)> {
                    all.iter()
                        .filter(|(i, _)| data.sights[*i].file == at)
                        .map(|(i, left)| (*i, left[axis]))
                        .collect()
                };
                let (was, is) = (of_file(&before), of_file(&after));
                if was.is_empty() {
                    continue;
                }
                let time = was.iter().enumerate().map(|(row, (i, _))| {
                    if data.timed { data.sights[*i].time } else { row as f64 }
                });
                found.push(Trace {
                    recording: file.name.clone(),
                    channel: channel.into(),
                    unit: "px".into(),
                    noise: data.sigma,
                    sigma: vec![data.sigma; was.len()],
                    held_out: vec![set != Set::Train; was.len()],
                    unseen: vec![set == Set::Unseen; was.len()],
                    along: if data.timed { "s" } else { "points" },
                    time: time.collect(),
                    before: was.iter().map(|(_, left)| *left).collect(),
                    after: is.iter().map(|(_, left)| *left).collect(),
                    against: None,
                });
            }
        }
    }
    found
}

/// What sets leave of the points, in the order of the points.
fn in_order(gap: &CameraGap, bent: &Bent, set: Set) -> Vec<(usize, nalgebra::Vector2<f64>)> {
    let mut left = gap.data.residuals(bent, set).unwrap_or_default();
    left.sort_by_key(|(at, _)| *at);
    left
}

impl Shows for CameraGap {
    fn left(&self, terms: &[Law], parameters: &[f64]) -> Vec<Left> {
        let bent = self.bent(terms, parameters);
        let of = |set: Set| {
            let rows = in_order(self, &bent, set);
            ["u", "v"].into_iter().enumerate().map(move |(axis, channel)| Left {
                channel: channel.into(),
                unit: "px".into(),
                noise: self.data.sigma,
                held_out: vec![set != Set::Train; rows.len()],
                values: rows.iter().map(|(_, left)| left[axis]).collect(),
            })
        };
        Set::ALL.into_iter().flat_map(of).collect()
    }

    fn states(&self, at: usize) -> Vec<State> {
        // Two channels a set.
        let rows = in_order(self, &self.bent(&[], &[]), Set::ALL[at / 2]);
        let sights = || rows.iter().map(|(at, _)| &self.data.sights[*at]);
        let state = |name: &str, unit: &str, values: Vec<f64>| State {
            name: name.into(),
            unit: unit.into(),
            values,
        };
        let mut found = vec![
            state("u", "px", sights().map(|sight| sight.pixel.x).collect()),
            state("v", "px", sights().map(|sight| sight.pixel.y).collect()),
        ];
        if self.data.timed {
            found.push(state("time", "s", sights().map(|sight| sight.time).collect()));
        }
        found
    }

    fn told(&self, term: &Law) -> Option<(String, String)> {
        Some((term.name().to_owned(), term.site().to_owned()))
    }

    fn seen(&self, _term: &Law) -> Seen {
        Seen::default()
    }
}
