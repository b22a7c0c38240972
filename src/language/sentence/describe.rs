//! Things told by where they stand, how big they are and what is in them: "the cup left of the jar", "the tallest cup",
//! "the die on the tray".
//!
//! A noun is resolved first; what stands beside it then chooses among what it may mean. Left, ahead and near are as the
//! robot looks from its base, as in `left_of(cup)`. What nobody has seen is never left out: then a person is asked.

use super::knowledge::{Knowledge, Spot, either};
use super::relation;
use super::resolve::{self, Found, Hindrance};

/// A thing is next to another when at most this is between them, m: as `next_to(o)` of a place.
const NEAR: f64 = 0.12;
/// What differs by less looks the same to a person, m: as far as a thing may be off after it was put down.
const SAME: f64 = 0.005;
/// A vessel with less than this is empty, m³: what clings to one that was poured out (0.3 mL measured), and to spare.
const EMPTY: f64 = 1e-6;
/// A thing is between two when it sees them at more than this angle apart, as a cosine: 120 deg.
const BETWEEN: f64 = -0.5;

/// Words of a clause that add nothing; "that" went with the articles.
const FILLERS: &[&str] = &[
    " which is ",
    " which stands ",
    " is ",
    " that's ",
    " stands ",
    " standing ",
    " lies ",
    " lying ",
    " sitting ",
    " placed ",
];

/// What chooses among things by itself.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Quality {
    Left,
    Right,
    Near,
    Far,
    Tall,
    Short,
    Big,
    Small,
    Empty,
    Filled,
}

const QUALITIES: &[(&str, Quality)] = &[
    ("leftmost", Quality::Left),
    ("left", Quality::Left),
    ("rightmost", Quality::Right),
    ("right", Quality::Right),
    ("nearest", Quality::Near),
    ("closest", Quality::Near),
    ("nearer", Quality::Near),
    ("closer", Quality::Near),
    ("front", Quality::Near),
    ("farthest", Quality::Far),
    ("furthest", Quality::Far),
    ("rearmost", Quality::Far),
    ("back", Quality::Far),
    ("tallest", Quality::Tall),
    ("taller", Quality::Tall),
    ("shortest", Quality::Short),
    ("shorter", Quality::Short),
    ("biggest", Quality::Big),
    ("bigger", Quality::Big),
    ("largest", Quality::Big),
    ("larger", Quality::Big),
    ("smallest", Quality::Small),
    ("smaller", Quality::Small),
    ("empty", Quality::Empty),
    ("full", Quality::Filled),
    ("filled", Quality::Filled),
];

/// Those of them that also say which way something goes.
const SIDES: &[&str] = &["left", "right", "front", "back"];

/// Returns the words that choose among things by themselves.
pub(super) fn qualities() -> impl Iterator<Item = &'static str> {
    QUALITIES.iter().map(|(word, _)| *word)
}

/// The same at the end of what is said.
const CONTENTS: &[(&str, Quality)] = &[
    (" with nothing in it", Quality::Empty),
    (" without water in it", Quality::Empty),
    (" without water", Quality::Empty),
    (" is empty", Quality::Empty),
    (" with water in it", Quality::Filled),
    (" with something in it", Quality::Filled),
    (" has water in it", Quality::Filled),
    (" with water", Quality::Filled),
    (" is full", Quality::Filled),
];

/// What nobody has to look for.
const TABLE: &str = "table";

/// How a thing stands to another.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Clause {
    Left,
    Right,
    Before,
    Behind,
    Beside,
    Between,
    Nearest,
    Farthest,
    /// On it or in it.
    Borne,
    /// The same of what is taken: also "fill the cup from the jar" is said so, and only what was seen there is meant.
    Taken,
}

/// Relations between blanks, the longer before those that they hold; those of places as [`relation`] joins them.
const CLAUSES: &[(&str, Clause)] = &[
    (" left_of ", Clause::Left),
    (" right_of ", Clause::Right),
    (" in_front_of ", Clause::Before),
    (" behind ", Clause::Behind),
    (" next_to ", Clause::Beside),
    (" between ", Clause::Between),
    (" closest to ", Clause::Nearest),
    (" nearest to ", Clause::Nearest),
    (" nearest ", Clause::Nearest),
    (" farthest from ", Clause::Farthest),
    (" furthest from ", Clause::Farthest),
    (" farthest away from ", Clause::Farthest),
    (" furthest away from ", Clause::Farthest),
    (" on top of ", Clause::Borne),
    (" on ", Clause::Borne),
    (" inside of ", Clause::Borne),
    (" inside ", Clause::Borne),
    (" in ", Clause::Borne),
    (" off ", Clause::Taken),
    (" from ", Clause::Taken),
];

/// Returns the things that a description means, without articles; `None` where nothing in it describes.
pub(super) fn described(
    phrase: &str,
    kind: Option<&str>,
    slot: &str,
    with: &Knowledge<'_>,
) -> Option<Result<Vec<Found>, Hindrance>> {
    let nouns = |said: &str| resolve::objects(said, kind, slot, with);
    for (end, quality) in CONTENTS {
        if let Some(noun) = phrase.strip_suffix(end) {
            let noun = noun.trim_end_matches(" which");
            return Some(nouns(noun).and_then(|found| chosen(found, *quality, noun, end, with)));
        }
    }
    let plain = FILLERS.iter().fold(phrase.to_owned(), |said, filler| said.replace(filler, " "));
    let clauses = clauses(&plain);
    let head = clauses.first().map_or(plain.len(), |(at, ..)| *at);
    let words: Vec<&str> = plain[..head].split(' ').collect();
    let quality = words.iter().enumerate().find_map(|(at, word)| {
        // "The jar back" tells where to, not which: a side stands before what it chooses among.
        let is_before = || words.get(at + 1).is_some_and(|next| resolve::is_of_a_thing(next, with));
        let found = QUALITIES.iter().find(|(known, _)| known == word)?;
        (plain.contains(' ') && (!SIDES.contains(word) || is_before())).then_some(found)
    });
    if let Some((word, quality)) = quality {
        let rest: Vec<&str> = plain.split(' ').filter(|said| said != word).collect();
        let rest = rest.join(" ");
        return Some(nouns(&rest).and_then(|found| chosen(found, *quality, &rest, word, with)));
    }
    let mut first = None;
    for (at, words, clause) in clauses {
        let (noun, other) = (&plain[..at], &plain[at + words.len()..]);
        let found =
            nouns(noun).and_then(|found| related(found, clause, (noun, words, other), with));
        match found {
            Ok(found) => return Some(Ok(found)),
            Err(hindrance) => first = first.or(Some(hindrance)),
        }
    }
    first.map(Err)
}

/// Returns the clause of a description that names a thing: "next to the cup" of "the jar next to the cup" for `cup`.
pub(super) fn clause_with<'p>(said: &'p str, thing: &str, with: &Knowledge<'_>) -> Option<&'p str> {
    clauses(said).into_iter().find_map(|(at, words, _)| {
        let others = resolve::objects(&said[at + words.len()..], None, "", with).ok()?;
        others.iter().any(|other| other.value == thing).then(|| said[at..].trim_start())
    })
}

/// Finds every clause, in order.
fn clauses(phrase: &str) -> Vec<(usize, &'static str, Clause)> {
    let mut found: Vec<(usize, &str, Clause)> = Vec::new();
    for (words, clause) in CLAUSES {
        for (at, _) in phrase.match_indices(words) {
            let is_part = |(known, long, _): &(usize, &str, Clause)| {
                *known <= at && at + words.len() <= known + long.len()
            };
            if !found.iter().any(is_part) {
                found.push((at, words, *clause));
            }
        }
    }
    found.sort_by_key(|(at, ..)| *at);
    found
}

/// Keeps what has a quality: the most of it, or what holds water or none.
fn chosen(
    found: Vec<Found>,
    quality: Quality,
    noun: &str,
    word: &str,
    with: &Knowledge<'_>,
) -> Result<Vec<Found>, Hindrance> {
    let spots: Vec<Option<Spot>> = found.iter().map(|one| (with.spot)(&one.value)).collect();
    let is_empty =
        |spot: &Option<Spot>| spot.as_ref().and_then(|spot| spot.water).map(|w| w < EMPTY);
    let keep: Vec<bool> = match quality {
        Quality::Empty => spots.iter().map(|spot| is_empty(spot) != Some(false)).collect(),
        Quality::Filled => spots.iter().map(|spot| is_empty(spot) != Some(true)).collect(),
        _ => {
            let Some(spots) = spots.into_iter().collect::<Option<Vec<Spot>>>() else {
                return Ok(found);
            };
            most(&spots.iter().map(|spot| amount(spot, quality)).collect::<Vec<_>>())
        }
    };
    kept(found, &keep, || format!("no {noun} is {}", word.trim().trim_start_matches("is ")))
}

/// How much of a quality a thing has, m.
fn amount(spot: &Spot, quality: Quality) -> f64 {
    match quality {
        Quality::Left => spot.left,
        Quality::Right => -spot.left,
        Quality::Near => -spot.left.hypot(spot.ahead),
        Quality::Far => spot.left.hypot(spot.ahead),
        Quality::Tall => spot.height,
        Quality::Short => -spot.height,
        Quality::Small => -spot.volume.cbrt(),
        Quality::Big | Quality::Empty | Quality::Filled => spot.volume.cbrt(),
    }
}

/// Marks the largest, and what a person could not tell from it.
fn most(amounts: &[f64]) -> Vec<bool> {
    let best = amounts.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    amounts.iter().map(|amount| best - amount < SAME).collect()
}

/// Keeps what stands so to another thing; `said`: the noun, the relation and the other as they were said.
fn related(
    mut found: Vec<Found>,
    clause: Clause,
    (noun, words, other): (&str, &str, &str),
    with: &Knowledge<'_>,
) -> Result<Vec<Found>, Hindrance> {
    let is_robot = matches!(other, "me" | "you" | "robot" | "base" | "yourself");
    let is_borne = matches!(clause, Clause::Borne | Clause::Taken);
    // The table stands nowhere.
    found.retain(|one| one.value != TABLE);
    let others: Vec<Option<Spot>> = if is_robot {
        vec![Some(Spot::default())]
    } else if is_borne && other == TABLE {
        Vec::new()
    } else {
        let parts = match (clause, other.split_once(" and ")) {
            (Clause::Between, Some((a, b))) => vec![a, b],
            (Clause::Between, None) => return Err(relation::between_two()),
            _ => vec![other],
        };
        let mut of = Vec::new();
        for part in parts {
            let things = resolve::objects(part, None, "", with)?;
            if is_borne {
                let is_there = |one: &Found| {
                    // Nothing is on itself.
                    if things.iter().all(|thing| thing.value == one.value) {
                        return Some(false);
                    }
                    let spot = (with.spot)(&one.value)?;
                    Some(things.iter().any(|thing| spot.on.as_ref() == Some(&thing.value)))
                };
                let unseen = clause == Clause::Borne;
                let keep: Vec<bool> =
                    found.iter().map(|one| is_there(one).unwrap_or(unseen)).collect();
                return kept(found, &keep, || none(noun, words, other));
            }
            found.retain(|one| {
                things.len() > 1 || things.iter().all(|thing| thing.value != one.value)
            });
            let [thing] = things.as_slice() else {
                let names: Vec<&str> = things.iter().map(|thing| thing.shown.as_str()).collect();
                let help = format!("say which: {}", either(&names));
                return Err(Hindrance::new(
                    format!("\"{part}\" may be several things"),
                    Some(help),
                ));
            };
            of.push((with.spot)(&thing.value));
        }
        of
    };
    let spots: Vec<Option<Spot>> = found.iter().map(|one| (with.spot)(&one.value)).collect();
    let (Some(others), true) =
        (others.into_iter().collect::<Option<Vec<Spot>>>(), spots.iter().any(Option::is_some))
    else {
        return Ok(found);
    };
    let keep: Vec<bool> = match clause {
        Clause::Nearest | Clause::Farthest => {
            let Some(spots) = spots.iter().cloned().collect::<Option<Vec<Spot>>>() else {
                return Ok(found);
            };
            let sign = if clause == Clause::Nearest { -1.0 } else { 1.0 };
            most(&spots.iter().map(|spot| sign * gap(spot, &others[0])).collect::<Vec<_>>())
        }
        _ => spots
            .iter()
            .map(|spot| spot.as_ref().is_none_or(|spot| stands(spot, clause, &others)))
            .collect(),
    };
    kept(found, &keep, || none(noun, words, other))
}

/// Whether a thing stands so to others. Each side is the quarter around its direction: every thing has one.
fn stands(spot: &Spot, clause: Clause, others: &[Spot]) -> bool {
    let to = |other: &Spot| [spot.left - other.left, spot.ahead - other.ahead];
    match (clause, others) {
        (Clause::Between, [a, b, ..]) => {
            let ([ax, ay], [bx, by]) = (to(a), to(b));
            ax * bx + ay * by < BETWEEN * ax.hypot(ay) * bx.hypot(by)
        }
        (Clause::Borne | Clause::Taken, _) => spot.on.is_none(),
        (_, [other, ..]) => {
            let [left, ahead] = to(other);
            match clause {
                Clause::Left => left >= ahead.abs(),
                Clause::Right => -left >= ahead.abs(),
                Clause::Behind => ahead >= left.abs(),
                Clause::Before => -ahead >= left.abs(),
                _ => gap(spot, other) <= NEAR,
            }
        }
        (_, []) => true,
    }
}

/// How far two things are apart on the table, m.
fn gap(a: &Spot, b: &Spot) -> f64 {
    (a.left - b.left).hypot(a.ahead - b.ahead) - a.radius - b.radius
}

/// "no cup is left of the jar".
fn none(noun: &str, words: &str, other: &str) -> String {
    format!("no {noun} is {} the {}", relation::spoken(words.trim()), relation::spoken(other))
}

/// Keeps the marked ones; where none is, says what there is.
fn kept(
    found: Vec<Found>,
    keep: &[bool],
    none: impl Fn() -> String,
) -> Result<Vec<Found>, Hindrance> {
    if keep.contains(&true) {
        let marked = found.into_iter().zip(keep).filter(|(_, keep)| **keep);
        return Ok(marked.map(|(one, _)| one).collect());
    }
    let names: Vec<&str> = found.iter().map(|one| one.shown.as_str()).collect();
    let help = (!names.is_empty()).then(|| format!("there is: {}", either(&names)));
    Err(Hindrance::new(none(), help))
}
