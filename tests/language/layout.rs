//! The canonical layout: it changes no meaning, keeps every note, and is final.

use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};
use trueup::language::{format, parse};

use super::stdlib::TEXTS;

/// Returns the tree of a text without the places in it.
fn tree(text: &str) -> String {
    let written = format!("{:?} {:?}", parse(text).0, codes(text));
    let mut out = String::with_capacity(written.len());
    let mut rest = written.as_str();
    while let Some((before, after)) = rest.split_once("Span {") {
        out.push_str(before);
        rest = after.split_once('}').map_or("", |(_, rest)| rest);
    }
    out + rest
}

fn codes(text: &str) -> Vec<&'static str> {
    parse(text).1.iter().map(|diagnostic| diagnostic.code).collect()
}

/// Returns the notes and the documentation of a text, in order.
fn notes(text: &str) -> Vec<String> {
    let mut notes = Vec::new();
    for line in text.lines() {
        let mut quoted = false;
        for (i, c) in line.char_indices() {
            quoted ^= c == '"' && !line[..i].ends_with('\\');
            if !quoted && line[i..].starts_with("//") {
                notes.push(line[i..].trim_end().to_owned());
                break;
            }
        }
    }
    notes
}

#[test]
fn what_is_embedded_is_laid_out_as_everything_is() {
    for (name, text) in TEXTS {
        assert_eq!(format(text), text, "{name}");
    }
}

/// Every form at once, as nobody should write it.
const UGLY: &str = "\
// first
#[ was ( \"old\" ) ]
task   t(o:Graspable , by : Length=5 cm)   {needs visible(o)// why
or   held(o)
/// prose
either #[was(\"x\")]a prior 0.5 when tall(o){look()}
or b{ home() }   // trailing



place(o, at:table|table) via   level_side,b while held(o) until   tall(o)   as p
break   when   tall(o)
repeat   upto 3 times{look()}until tall(o)
let x=-3 cm   let y=3-2   let z = by -2 cm
if not(visible(o)){look()}else if tall(o){home()}else{ home() }
together{ look() as a
home() as b
timing a before b by 3 s}
on failure   of look{ retry   other upto 2 times}
on failure{abort \"a // b\"}}
scene s { camera c { image 100 x 200 focal~900 px at(1 m,-2 m,0 m) looking (0 m , 0 m, 0 m) } }
twin w of s{effect e(j){torque=1.83 N*m+-0.04 N*m}}
model m { x'=-k1*x+2**3-1 state h=free~3 in -2 to -1 }
import   \"a.rhai\"
fluent f(a:Object)=tilt(a)==0 deg within 10 deg ask \"Is {a} // level?\"
";

#[test]
fn the_layout_of_every_form() {
    let expected = "\
// first
#[was(\"old\")]
task t(o: Graspable, by: Length = 5 cm) { needs visible(o) // why
        or held(o)
    /// prose
    either #[was(\"x\")] a prior 0.5 when tall(o) { look() }
    or b { home() } // trailing

    place(o, at: table | table) via level_side, b while held(o) until tall(o) as p
    break when tall(o)
    repeat upto 3 times { look() } until tall(o)
    let x = -3 cm let y = 3 - 2 let z = by - 2 cm
    if not(visible(o)) { look() } else if tall(o) { home() } else { home() }
    together { look() as a
        home() as b
        timing a before b by 3 s }
    on failure of look { retry other upto 2 times }
    on failure { abort \"a // b\" } }
scene s { camera c { image 100 x 200 focal ~ 900 px at(1 m, -2 m, 0 m) looking (0 m, 0 m, 0 m) } }
twin w of s { effect e(j) { torque = 1.83 N*m +- 0.04 N*m } }
model m { x' = -k1*x + 2**3 - 1 state h = free ~ 3 in -2 to -1 }
import \"a.rhai\"
fluent f(a: Object) = tilt(a) == 0 deg within 10 deg ask \"Is {a} // level?\"
";
    assert_eq!(format(UGLY), expected);
}

#[test]
fn what_is_laid_out_means_the_same_and_is_final() {
    let sample = include_str!("sample.task");
    let texts = TEXTS.iter().map(|(_, text)| *text).chain([UGLY, sample]);
    for text in texts {
        let once = format(text);
        assert_eq!(tree(&once), tree(text));
        assert_eq!(notes(&once), notes(text));
        assert_eq!(format(&once), once);
    }
}

/// Blanks put in and taken away where they carry no meaning: the same tree comes out, laid out or not.
#[test]
fn any_layout_of_a_text_is_laid_out_to_the_same_meaning() {
    let mut rng = StdRng::seed_from_u64(5);
    let texts = TEXTS.iter().map(|(_, text)| *text).chain([UGLY]);
    for text in texts {
        let meant = tree(text);
        for _ in 0..6 {
            let shaken = shake(text, &mut rng);
            assert_eq!(tree(&shaken), meant, "{shaken}");
            let once = format(&shaken);
            assert_eq!(tree(&once), meant, "{once}");
            assert_eq!(notes(&once), notes(text));
            assert_eq!(format(&once), once);
        }
    }
}

/// Adds blanks beside signs and after lines, and takes away indentation.
fn shake(text: &str, rng: &mut StdRng) -> String {
    let mut out = String::new();
    for line in text.lines() {
        let body = line.trim_start();
        // An item begins at its left edge; inside, indentation means nothing.
        if body.len() < line.len() {
            out.extend(std::iter::repeat_n(' ', rng.random_range(1..9)));
        }
        let mut quoted = false;
        for (i, c) in body.char_indices() {
            quoted ^= c == '\"';
            if !quoted && body[i..].starts_with("//") {
                out.push_str(&body[i..]);
                break;
            }
            let blank = !quoted && matches!(c, ',' | '(' | '{') && rng.random_bool(0.3);
            out.push(c);
            if blank {
                out.push_str(if rng.random_bool(0.3) { "\t" } else { "  " });
            }
        }
        for _ in 0..rng.random_range(1..4) {
            out.push('\n');
        }
    }
    out
}

/// Damaged texts are laid out as well: nothing of them is lost, and what is wrong stays wrong alike.
#[test]
fn damaged_texts_keep_every_token() {
    let mut rng = StdRng::seed_from_u64(6);
    for (_, text) in TEXTS {
        for _ in 0..10 {
            let mut damaged: Vec<char> = text.chars().collect();
            for _ in 0..3 {
                let at = rng.random_range(0..damaged.len());
                damaged.remove(at);
            }
            let damaged: String = damaged.into_iter().collect();
            let once = format(&damaged);
            assert_eq!(format(&once), once);
            let bare = |text: &str| -> String { text.split_whitespace().collect() };
            assert_eq!(bare(&once), bare(&damaged));
        }
    }
}
