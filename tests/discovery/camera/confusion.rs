//! How often a planted effect is named: the confusion table of `docs/gap-camera.md`.
//!
//! `cargo test --release --test main camera::confusion -- --ignored --nocapture` makes it with 20 seeds; the quick
//! test beside it takes one seed of each kind.
#![expect(clippy::print_stderr, reason = "what was measured is for people to read")]

use std::collections::BTreeMap;

use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};
use trueup::discovery::finding::{Finding, Value, Verdict};

use super::{Shot, Truth, found, posed, unposed};

/// A number that was planted: effect, parameter, component, value.
type Planted = (&'static str, &'static str, usize, f64);

/// How the points are taken.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Kind {
    Table,
    Boards,
    Film,
}

const SINGLE: [(&str, Kind); 13] = [
    ("nothing", Kind::Table),
    ("nothing", Kind::Boards),
    ("nothing", Kind::Film),
    ("radial_distortion", Kind::Table),
    ("radial_distortion", Kind::Boards),
    ("tangential_distortion", Kind::Table),
    ("tangential_distortion", Kind::Boards),
    ("focal_error", Kind::Table),
    ("focal_error", Kind::Boards),
    ("principal_point_shift", Kind::Table),
    ("camera_shift", Kind::Table),
    ("table_tilt", Kind::Table),
    ("image_delay", Kind::Film),
];

const PAIRS: [(&str, &str, Kind); 7] = [
    ("radial_distortion", "principal_point_shift", Kind::Table),
    ("radial_distortion", "focal_error", Kind::Table),
    ("radial_distortion", "camera_shift", Kind::Table),
    ("focal_error", "camera_shift", Kind::Table),
    ("radial_distortion", "focal_error", Kind::Boards),
    ("image_delay", "focal_error", Kind::Film),
    ("rolling_shutter", "radial_distortion", Kind::Film),
];

/// Plants an effect of a random size, from one that is a few times what can be seen to a large one.
fn plant(truth: &mut Truth, name: &'static str, random: &mut StdRng) -> Vec<Planted> {
    let mut size = |least: f64, most: f64| {
        let value = random.random_range(least..most);
        if random.random_bool(0.5) { value } else { -value }
    };
    match name {
        "radial_distortion" => {
            truth.k[0] = size(0.03, 0.25);
            vec![(name, "k1", 0, truth.k[0])]
        }
        "tangential_distortion" => {
            truth.p = [size(1.5e-3, 6e-3), size(1.5e-3, 6e-3)];
            vec![(name, "p1", 0, truth.p[0]), (name, "p2", 0, truth.p[1])]
        }
        "focal_error" => {
            let factor = 1.0 + size(0.008, 0.04);
            truth.focal = [factor; 2];
            vec![(name, "fx_scale", 0, factor)]
        }
        "principal_point_shift" => {
            truth.centre = [size(4.0, 15.0), size(4.0, 15.0)];
            vec![(name, "du", 0, truth.centre[0]), (name, "dv", 0, truth.centre[1])]
        }
        "camera_shift" => {
            for i in 0..3 {
                truth.shift[i] = size(5e-3, 0.03);
                truth.shift[i + 3] = size(4e-3, 0.03);
            }
            let shift = truth.shift;
            (0..3)
                .flat_map(|i| [(name, "xyz", i, shift[i]), (name, "rpy", i, shift[i + 3])])
                .collect()
        }
        "table_tilt" => {
            truth.table = [size(5e-3, 0.03), size(5e-3, 0.03), size(2e-3, 0.015)];
            ["roll", "pitch", "height"]
                .into_iter()
                .zip(truth.table)
                .map(|(p, v)| (name, p, 0, v))
                .collect()
        }
        "image_delay" => {
            truth.delay = size(0.01, 0.12).abs();
            vec![(name, "delay", 0, truth.delay)]
        }
        "rolling_shutter" => {
            truth.row_time = size(1.5e-5, 5e-5).abs();
            vec![(name, "row_time", 0, truth.row_time)]
        }
        _ => Vec::new(),
    }
}

fn taken(truth: &Truth, kind: Kind, seed: u64) -> Finding {
    let shot = Shot::with(seed);
    match kind {
        Kind::Table => {
            let second = Shot::with(seed + 1000);
            found(&[truth.table_picture(shot, true), truth.table_picture(second, true)], &posed())
        }
        Kind::Boards => found(&[truth.board_pictures(shot, 9, true)], &unposed()),
        Kind::Film => found(&[truth.film(shot)], &posed()),
    }
}

#[derive(Debug, Default)]
struct Score {
    tried: usize,
    /// Exactly the planted names, no doubt.
    right: usize,
    /// A doubt that holds every planted name.
    doubt: usize,
    /// What was said otherwise.
    otherwise: Vec<String>,
    numbers: usize,
    within_tenth: usize,
    worst: f64,
    shrinks: Vec<f64>,
}

fn scored(kinds: &[(Vec<&'static str>, Kind)], seeds: u64) -> BTreeMap<String, Score> {
    let mut scores: BTreeMap<String, Score> = BTreeMap::new();
    for (names, kind) in kinds {
        let score = scores.entry(format!("{} ({kind:?})", names.join(" + "))).or_default();
        for seed in 1..=seeds {
            let mut random = StdRng::seed_from_u64(seed * 7919);
            let mut truth = Truth::default();
            let planted: Vec<Planted> =
                names.iter().flat_map(|name| plant(&mut truth, name, &mut random)).collect();
            let finding = taken(&truth, *kind, seed);
            count(score, names, &planted, &finding);
        }
    }
    scores
}

fn count(score: &mut Score, names: &[&str], planted: &[Planted], finding: &Finding) {
    let mut wanted: Vec<&str> = names.iter().copied().filter(|name| *name != "nothing").collect();
    wanted.sort_unstable();
    let said = super::names(finding);
    score.tried += 1;
    let all = wanted.iter().all(|name| said.contains(name));
    match finding.verdict {
        Verdict::Ambiguous if all && !wanted.is_empty() => score.doubt += 1,
        Verdict::Ambiguous => score.otherwise.push(format!("{said:?}, in doubt")),
        _ if said == wanted => score.right += 1,
        _ => score.otherwise.push(format!("{said:?}")),
    }
    if !all {
        return;
    }
    if !wanted.is_empty() {
        score.shrinks.push(finding.gap.shrink_heldout);
    }
    for (name, parameter, component, truth) in planted {
        let effect = finding.effects.iter().find(|effect| effect.name == *name).unwrap();
        let value = match &effect.parameters[*parameter].value {
            Value::Number(value) => *value,
            Value::Vector(values) => values[*component],
        };
        // A factor's error is that of its distance from 1.
        let size = if *name == "focal_error" { truth - 1.0 } else { *truth };
        let error = ((value - truth) / size).abs();
        score.numbers += 1;
        score.within_tenth += usize::from(error < 0.1);
        score.worst = score.worst.max(error);
    }
}

fn kinds() -> Vec<(Vec<&'static str>, Kind)> {
    let single = SINGLE.into_iter().map(|(name, kind)| (vec![name], kind));
    let pairs = PAIRS.into_iter().map(|(a, b, kind)| (vec![a, b], kind));
    single.chain(pairs).collect()
}

fn table(scores: &BTreeMap<String, Score>) {
    for (name, score) in scores {
        let mut shrinks = score.shrinks.clone();
        shrinks.sort_by(f64::total_cmp);
        eprintln!(
            "| {name} | {} | {} | {} | {}/{} | {:.1} % | {} | {} |",
            score.tried,
            score.right,
            score.doubt,
            score.within_tenth,
            score.numbers,
            100.0 * score.worst,
            shrinks.get(shrinks.len() / 2).map_or("–".into(), |s| format!("{s:.3}")),
            score.otherwise.join("; ")
        );
    }
}

#[test]
#[ignore = "makes the table of docs/gap-camera.md: some minutes"]
fn the_table() {
    let scores = scored(&kinds(), 20);
    table(&scores);
    let alarms: usize = scores
        .iter()
        .filter(|(name, _)| name.starts_with("nothing"))
        .map(|(_, score)| score.otherwise.len())
        .sum();
    assert_eq!(alarms, 0, "alarms where nothing was planted");
}

#[test]
fn most_of_what_is_planted_is_named() {
    let scores = scored(&kinds(), 1);
    table(&scores);
    let tried: usize = scores.values().map(|score| score.tried).sum();
    let named: usize = scores.values().map(|score| score.right + score.doubt).sum();
    assert!(named * 100 >= tried * 95, "{named} of {tried}");
}
