//! Several wishes in one sentence: "pick up the jar, then put it down" → `pick(jar) then place(jar)`.
//!
//! A sentence is cut where a word joins two wishes, if each part by itself is one. Each part may call what the part
//! before it handled "it". Who says "take the jar and pour it" means one thing to do: what takes something itself is not
//! told to take it first.

use super::super::ast::ExprKind;
use super::hand::{self, Hand};
use super::knowledge::Knowledge;
use super::meaning::{Meaning, Understood};
use super::{MOST_CHOICES, alone, nearest_sentence, one};

/// Words between two wishes; the longer before those that they hold.
const JOINS: &[&str] = &[" and after that ", " after that ", " and then ", " then ", " and "];
/// So many wishes at most: more belong into a task.
const MOST_WISHES: usize = 8;

/// Reads a sentence as several wishes; `None` where it cannot be cut into parts that are known.
pub(super) fn understand(said: &str, with: &Knowledge<'_>) -> Option<Meaning> {
    let Some(parts) = cut(said, with, MOST_WISHES) else { return broken_off(said, with) };
    let mut question = None;
    let mut ways: Vec<Vec<Understood>> = vec![Vec::new()];
    for part in parts {
        let mut longer = Vec::new();
        for way in ways {
            // Whether a later wish can be done is known when those before it are; what they leave in the hand tells which was meant.
            let hand = in_hand(&way, with);
            let touched: Vec<&str> = way.iter().flat_map(touched).collect();
            let later = Knowledge {
                it: way.last().and_then(handled).or(with.it),
                spot: &|name| (with.spot)(name).filter(|_| !touched.contains(&name)),
                hindrance: &|_| None,
                ..*with
            };
            let meaning = one(part, if way.is_empty() { with } else { &later });
            let readings = match meaning {
                Meaning::Clear(reading) => {
                    let stuck = after_nothing(&way, &reading, hand.as_ref(), with);
                    if stuck.is_some() {
                        return stuck;
                    }
                    vec![reading]
                }
                Meaning::Ambiguous { question: which, choices } => {
                    let choices = able(choices, hand.as_ref(), with);
                    question = question.or((choices.len() > 1).then_some(which));
                    choices
                }
                hindered => return Some(hindered),
            };
            longer.extend(readings.into_iter().map(|reading| followed(&way, reading, with)));
        }
        longer.truncate(MOST_CHOICES);
        ways = longer;
    }
    let mut ways: Vec<Understood> = ways.into_iter().filter_map(joined).collect();
    Some(match (ways.len(), question) {
        (1, _) | (_, None) => alone(ways.swap_remove(0), with),
        (_, Some(question)) => Meaning::Ambiguous { question, choices: ways },
    })
}

/// Returns what is in the hand after some wishes, or before the first when nothing was said to be.
fn in_hand(way: &[Understood], with: &Knowledge<'_>) -> Option<Hand> {
    if way.is_empty() {
        return with.it.is_none().then_some(Hand::Empty);
    }
    let calls = way.iter().flat_map(|wish| &wish.calls);
    calls.fold(None, |hand, call| hand::after(call, hand, with.library))
}

/// Says when a wish needs something in the hand, and those before it leave nothing there.
fn after_nothing(
    way: &[Understood],
    next: &Understood,
    hand: Option<&Hand>,
    with: &Knowledge<'_>,
) -> Option<Meaning> {
    let (last, call) = (way.last()?, next.calls.first()?);
    let is_stuck = hand == Some(&Hand::Empty) && !hand::can_begin(call, &Hand::Empty, with.library);
    is_stuck.then(|| Meaning::Impossible {
        why: format!(
            "`{}` needs something in the hand, and after `{}` nothing is in it",
            next.text, last.text
        ),
        help: Some("leave it out, or say where the thing is to go".into()),
    })
}

/// Keeps the readings that can begin with that in the hand, if any can.
pub(super) fn able(
    choices: Vec<Understood>,
    hand: Option<&Hand>,
    with: &Knowledge<'_>,
) -> Vec<Understood> {
    let Some(hand) = hand else { return choices };
    let is_able = |reading: &Understood| {
        let first = reading.calls.first();
        first.is_none_or(|call| hand::can_begin(call, hand, with.library))
    };
    let able: Vec<Understood> = choices.iter().filter(|one| is_able(one)).cloned().collect();
    if able.is_empty() { choices } else { able }
}

/// Returns wishes with one more, which takes the place of the last where it takes by itself what that would take.
fn followed(way: &[Understood], next: Understood, with: &Knowledge<'_>) -> Vec<Understood> {
    let is_taken_again = |last: &Understood| match (&last.calls[..], next.calls.first()) {
        ([take], Some(call)) => hand::takes_again(take, call, with.library),
        _ => false,
    };
    let kept = way.len() - usize::from(way.last().is_some_and(is_taken_again));
    way[..kept].iter().cloned().chain([next]).collect()
}

/// Names the part that is not understood, where the first is and something follows it.
fn broken_off(said: &str, with: &Knowledge<'_>) -> Option<Meaning> {
    JOINS.iter().filter(|join| join.contains("then")).find_map(|join| {
        let (first, rest) = said.split_once(join)?;
        let is_meant = matches!(one(first, with), Meaning::Clear(_) | Meaning::Ambiguous { .. });
        let like = nearest_sentence(rest, with);
        is_meant.then(|| Meaning::Unknown { help: format!("\"{rest}\" is not understood; {like}") })
    })
}

/// Returns what the last call handled: its first argument.
fn handled(before: &Understood) -> Option<&str> {
    match &before.calls.last()?.args.first()?.values.first()?.kind {
        ExprKind::Name(name) => Some(name),
        _ => None,
    }
}

/// Returns what the calls so far may have moved or filled: everything that they name.
fn touched(before: &Understood) -> Vec<&str> {
    let values = before.calls.iter().flat_map(|call| &call.args).flat_map(|arg| &arg.values);
    let named = values.filter_map(|value| match &value.kind {
        ExprKind::Name(name) => Some(name.as_str()),
        _ => None,
    });
    named.collect()
}

/// Returns wishes as one reading; `None` of none.
fn joined(wishes: Vec<Understood>) -> Option<Understood> {
    wishes.into_iter().reduce(|before, next| {
        let text = |a: &str, b: &str, by: &str| format!("{a}{by}{b}");
        Understood {
            text: text(&before.text, &next.text, " then "),
            calls: before.calls.into_iter().chain(next.calls).collect(),
            template: text(&before.template, &next.template, "\", \""),
            slots: before.slots.into_iter().chain(next.slots).collect(),
            defaults: before.defaults.into_iter().chain(next.defaults).collect(),
        }
    })
}

/// Cuts a sentence into parts that each are like a sentence that is known, the first as short as it can be.
fn cut<'s>(said: &'s str, with: &Knowledge<'_>, most: usize) -> Option<Vec<&'s str>> {
    let is_known = |part: &str| !matches!(one(part, with), Meaning::Unknown { .. });
    let mut places: Vec<(usize, &str)> =
        JOINS.iter().flat_map(|join| said.match_indices(join).map(|(at, _)| (at, *join))).collect();
    places.sort_by_key(|(at, join)| (*at, std::cmp::Reverse(join.len())));
    places.into_iter().take_while(|_| most > 1).find_map(|(at, join)| {
        let (first, rest) = (&said[..at], &said[at + join.len()..]);
        if !is_known(first) {
            return None;
        }
        let rest = cut(rest, with, most - 1).or_else(|| is_known(rest).then(|| vec![rest]))?;
        Some([vec![first], rest].concat())
    })
}
