//! The page of a run that is looked at while it goes on: camera beside twin, fluents, water over time, rehearsals.
//!
//! The page reads without scripts, anew every three seconds. With them it asks for `/watch/state` several times a
//! second, which is the part below the pictures, and changes the pictures when they are there.

use std::fmt::Write as _;

use crate::files::read;
use crate::http::{Request, Response};
use crate::report::html::{self, escaped};
use crate::trace::Tryout;

use super::frame::View;
use super::routes::JPEG;
use super::screen::{Screen, Seen};

/// Size of the drawing of the water.
const DRAWING: (f64, f64) = (520.0, 180.0);
/// Room beside its curves for their names.
const NAMES: f64 = 110.0;

/// Answers `/watch/…`.
pub(super) fn answer(screen: &Screen, request: &Request, path: &[&str]) -> Option<Response> {
    let seen = screen.now();
    let fresh = |response: Response| Some(response.with("Cache-Control", "no-store"));
    let picture = |jpeg: Option<Vec<u8>>| match jpeg {
        Some(jpeg) => Some(
            // Its address names the moment.
            Response::new(200, JPEG, jpeg).with("Cache-Control", "private, max-age=60"),
        ),
        None => Some(Response::text(404, "there is no such picture yet")),
    };
    match path {
        ["state"] => {
            let known: Option<u64> = request.asked("after").and_then(|after| after.parse().ok());
            screen.took(known.unwrap_or(0));
            if known == Some(seen.version) {
                return fresh(Response::text(204, ""));
            }
            fresh(Response::new(200, "text/html; charset=utf-8", state(&seen)))
        }
        ["real.jpg"] => picture(seen.still.and_then(|still| still.real.clone())),
        ["twin.jpg"] => picture(seen.still.and_then(|still| still.twin.clone())),
        ["tryout", number] => {
            let number: Option<usize> = number.strip_suffix(".jpg").and_then(|n| n.parse().ok());
            let found = seen.tryouts.iter().find(|tryout| Some(tryout.number) == number);
            picture(found.and_then(|tryout| tryout.picture.clone()))
        }
        ["report.html"] => match seen.report.map(|path| read::bytes(&path, read::DATA)) {
            Some(Ok(page)) => fresh(Response::new(200, "text/html; charset=utf-8", page)),
            _ => Some(Response::text(404, "the report is written when the run is over")),
        },
        _ => None,
    }
}

/// The page.
pub(super) fn view(screen: &Screen) -> View {
    let seen = screen.now();
    let mut main = format!(
        "<h1 class=\"call\" id=\"task\">{}</h1>\n<div class=\"pair\">\n",
        escaped(&seen.task)
    );
    let number = seen.still.as_ref().map(|still| still.number);
    for (whose, words) in [("real", "camera"), ("twin", "twin, as rehearsed for this moment")] {
        let has = seen.still.as_ref().is_some_and(|still| match whose {
            "real" => still.real.is_some(),
            _ => still.twin.is_some(),
        });
        let source = number
            .filter(|_| has)
            .map_or(String::new(), |number| format!(" src=\"{}\"", address(&seen, whose, number)));
        let _ = writeln!(
            main,
            "<figure><img id=\"watch-{whose}\"{source} width=\"480\" height=\"270\" alt=\"\">\
             <figcaption>{words}</figcaption></figure>"
        );
    }
    let _ = write!(main, "</div>\n{}", state(&seen));
    let mut view = View::new(format!("live: {}", seen.task), "/watch", main);
    view.says.clone_from(&seen.doing);
    view.reads_again = !seen.is_over();
    view
}

/// What is below the pictures, with all a script needs to know.
fn state(seen: &Seen) -> String {
    let still = seen.still.as_deref();
    let named = |whose: &str, has: bool| match still {
        Some(still) if has => format!(" data-{whose}=\"{}\"", address(seen, whose, still.number)),
        _ => String::new(),
    };
    let over = if seen.is_over() { " data-over=\"yes\"" } else { "" };
    let ended = if seen.ended.is_some() { " data-ended=\"yes\"" } else { "" };
    let mut text = format!(
        "<div id=\"watched\" data-version=\"{}\" data-task=\"{}\"{}{}{ended}{over}>\n",
        seen.version,
        escaped(&seen.task),
        named("real", still.is_some_and(|still| still.real.is_some())),
        named("twin", still.is_some_and(|still| still.twin.is_some())),
    );
    if let Some(ended) = &seen.ended {
        text += &end(seen, ended);
    } else if seen.run == 0 && seen.goes_on {
        text += "<p class=\"doing\"><b>Nothing runs yet.</b> Type a task at the prompt, such as \
                 <span class=\"call\">pour(jar, cup)</span>.</p>\n";
    } else {
        let _ = writeln!(text, "<p class=\"doing\"><b>{}</b></p>", escaped(&seen.doing));
        let (number, of) = seen.step;
        if of > 0 {
            let _ = writeln!(
                text,
                "<progress value=\"{number}\" max=\"{of}\" aria-label=\"steps\"></progress>"
            );
        }
    }
    text += "<div class=\"watch\">\n<div>\n";
    text += &water(seen);
    text += &tryouts(&seen.tryouts, seen.version);
    text += "</div>\n";
    text += &fluents(seen);
    text + "</div>\n</div>\n"
}

/// Where the picture of a moment of a run is.
fn address(seen: &Seen, whose: &str, number: usize) -> String {
    format!("/watch/{whose}.jpg?run={}&amp;n={number}", seen.run)
}

fn end(seen: &Seen, ended: &str) -> String {
    let mut text = format!(
        "<section class=\"card\"><h2>The run is over</h2>\n<pre>{}</pre>\n",
        escaped(ended)
    );
    if let Some(path) = &seen.report {
        let _ = writeln!(
            text,
            "<p><a id=\"report\" class=\"button strong\" href=\"/watch/report.html\" target=\"_blank\">Open the \
             report</a> <span class=\"soft\">It is kept in <span class=\"call\">{}</span>.</span></p>",
            escaped(&path.display().to_string())
        );
    }
    text + "</section>\n"
}

/// What is true, what is not, and what is not known, the last changes lit.
fn fluents(seen: &Seen) -> String {
    let mut text =
        "<section class=\"card\" aria-label=\"fluents\"><h2>Fluents as measured</h2>\n".to_owned();
    let mut known: Vec<_> = seen.fluents.iter().filter(|(_, truth, _)| truth.is_some()).collect();
    if known.is_empty() {
        return text
            + "<p class=\"soft\">None is measured before the first step has ended.</p></section>\n";
    }
    known.sort_by_key(|(_, truth, _)| *truth != Some(true));
    text += "<ul class=\"lights\">\n";
    let last = known.iter().map(|(.., step)| *step).max().unwrap_or(0);
    for (name, truth, step) in known {
        let lit = if *step == last && seen.step.0 > 1 { " lit" } else { "" };
        let word = html::truth(*truth);
        let _ = writeln!(
            text,
            "<li class=\"{}{lit}\"><span class=\"call\">{}</span> <b>{word}</b></li>",
            if *truth == Some(true) { "on" } else { "off" },
            escaped(name)
        );
    }
    text + "</ul></section>\n"
}

/// The water in the twin's vessels over time.
fn water(seen: &Seen) -> String {
    let most = seen.water.iter().flat_map(|(_, volumes)| volumes).fold(0.0_f64, |a, b| a.max(*b));
    let (Some((first, _)), Some((last, now))) = (seen.water.first(), seen.water.last()) else {
        return String::new();
    };
    if most < 1.0 {
        return String::new();
    }
    let (width, height) = DRAWING;
    // At least the time of a pour, so that the curves do not shrink all the while.
    let span = (last - first).max(30.0);
    let at = |time: f64, volume: f64| {
        let x = (time - first) / span * (width - NAMES);
        (x, height - 4.0 - volume / most * (height - 26.0))
    };
    let mut text = format!(
        "<section class=\"card\" aria-label=\"water\"><h2>Water in the twin</h2>\n<svg class=\"curves\" \
         viewBox=\"0 0 {width} {height}\" role=\"img\" aria-label=\"water over time\">\n\
         <line class=\"axis\" x1=\"0\" x2=\"{}\" y1=\"{y}\" y2=\"{y}\"/>\n",
        width - NAMES,
        y = height - 4.0
    );
    let mut ends: Vec<(f64, usize)> = Vec::new();
    for (k, name) in seen.vessels.iter().enumerate() {
        if name == "spilt" && seen.water.iter().all(|(_, volumes)| volumes[k] < 0.5) {
            continue;
        }
        let points: Vec<String> = seen
            .water
            .iter()
            .map(|(time, volumes)| at(*time, volumes[k]))
            .map(|(x, y)| format!("{x:.1},{y:.1}"))
            .collect();
        let _ =
            writeln!(text, "<polyline class=\"curve-{}\" points=\"{}\"/>", k % 4, points.join(" "));
        ends.push((at(*last, now[k]).1, k));
    }
    ends.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut free = 14.0;
    for (y, k) in ends {
        let (x, y) = (at(*last, 0.0).0 + 6.0, (y + 5.0).min(height - 10.0).max(free));
        let name = escaped(&seen.vessels[k]);
        let _ = writeln!(
            text,
            "<text class=\"curve-{}\" x=\"{x:.1}\" y=\"{y:.1}\">{name} {:.0} mL</text>",
            k % 4,
            now[k]
        );
        free = y + 20.0;
    }
    text + "</svg></section>\n"
}

/// The rehearsals, each with its last picture and how it went.
fn tryouts(tryouts: &[Tryout], version: u64) -> String {
    if tryouts.is_empty() {
        return String::new();
    }
    let mut text =
        "<section class=\"card\" aria-label=\"rehearsals\"><h2>Rehearsals in the twin</h2>\n<ol class=\"tryouts\">\n".to_owned();
    for tryout in tryouts {
        let (class, word) = match &tryout.went {
            None => ("on", "goes on".to_owned()),
            Some(Ok(())) => ("yes", "succeeded".to_owned()),
            Some(Err(why)) => ("no", format!("failed: {why}")),
        };
        text += "<li>";
        if let Some(picture) = &tryout.picture {
            // Another picture is another address; how long it is tells it from the one before.
            let n = if tryout.went.is_none() { version } else { picture.len() as u64 };
            let _ = write!(
                text,
                "<img src=\"/watch/tryout/{}.jpg?n={n}\" width=\"240\" height=\"135\" alt=\"\">",
                tryout.number
            );
        }
        let _ = writeln!(
            text,
            "<span class=\"call\">{}</span> <b class=\"{class}\">{}</b></li>",
            escaped(&tryout.name),
            escaped(&word)
        );
    }
    text + "</ol></section>\n"
}
