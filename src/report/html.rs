//! What pages are made of, whether written to a file or served: the look, tables of fluents, pictures of both
//! worlds side by side, questions with geometry's answers.
//!
//! Text is escaped here and nowhere else. A page made of this needs nothing from outside, reads without
//! scripts and without colours.

use std::fmt::Write as _;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use sha2::{Digest as _, Sha256};

use crate::trace::{FluentRow, Measure, Outcome, StepRecord};
use crate::workcell::Ending;
use crate::workcell::archive::Standing;

use super::run::{agreement, is_news, people};
use super::why;

/// The style sheet that every page has.
pub const LOOK: &str = include_str!("look.css");

/// Returns a text as it may stand in a page.
pub fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// What a page that is a file of its own may do: show its pictures and its look. Beside a script of ours, known by
/// its sum, nothing runs in it, whatever a run folder of a stranger's held.
const POLICY: &str = "default-src 'none'; style-src 'unsafe-inline'; img-src data:";

/// Returns a page that is a file of its own.
pub fn document(title: &str, body: &str) -> String {
    whole(title, body, POLICY)
}

/// As [`document`], with the one script that may run in it.
pub fn with_script(title: &str, body: &str, script: &str) -> String {
    let sum = STANDARD.encode(Sha256::digest(script.as_bytes()));
    let policy = format!("{POLICY}; script-src 'sha256-{sum}'");
    whole(title, &format!("{body}<script>{script}</script>\n"), &policy)
}

fn whole(title: &str, body: &str, policy: &str) -> String {
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta http-equiv=\"Content-Security-Policy\" content=\"{policy}\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <title>{}</title>\n<style>\n{LOOK}</style>\n</head>\n<body>\n{body}</body>\n</html>\n",
        escaped(title)
    )
}

/// Marks yes, no and unknown by sign, word and colour.
pub fn truth(truth: Option<bool>) -> &'static str {
    match truth {
        Some(true) => "<span class=\"truth yes\">✓ yes</span>",
        Some(false) => "<span class=\"truth no\">✗ no</span>",
        None => "<span class=\"truth unknown\">? unknown</span>",
    }
}

/// How a step ended, by sign and word.
pub fn outcome(step: &StepRecord) -> &'static str {
    match step.outcome {
        Outcome::Success if !step.was_carried_out() => "– not needed",
        Outcome::Success => "✓ done",
        Outcome::Failure => "✗ failed",
        Outcome::Stopped => "◦ stopped",
    }
}

/// How a run ended, by sign and word.
pub fn ending(standing: Standing) -> &'static str {
    match standing {
        Standing::Running => "… running",
        Standing::CutOff => "… cut off",
        Standing::Ended(Ending::Success) => "✓ done",
        Standing::Ended(Ending::Unconfirmed) => "? unconfirmed",
        Standing::Ended(Ending::Failure) => "✗ failed",
        Standing::Ended(Ending::Stopped) => "◦ stopped",
        Standing::Ended(Ending::Unavailable) => "✗ unavailable",
    }
}

/// A margin with its uncertainty: `-31 mm ± 1 mm`.
pub fn margin(margin: Option<&Measure>, std: Option<&Measure>) -> String {
    let Some(margin) = margin else { return String::new() };
    let mut text = people(margin);
    if let Some(std) = std {
        let size = people(std);
        let _ = write!(text, " ± {}", size.trim_start_matches('+'));
    }
    text
}

/// An address of more about a fluent, where there is any.
pub type More<'a> = &'a dyn Fn(&FluentRow) -> Option<String>;

/// The fluents after a step: those that are news after the fluents `before` it, and the others folded
/// away. `more` gives the address behind each name.
pub fn fluents(rows: &[FluentRow], before: &[FluentRow], more: More<'_>) -> String {
    let (news, others): (Vec<_>, Vec<_>) = rows.iter().partition(|row| is_news(row, before));
    let mut text = String::new();
    if news.is_empty() {
        text += "<p class=\"soft\">No fluent changed, and none was promised.</p>\n";
    } else {
        text += &table(&news, more);
    }
    if !others.is_empty() {
        let _ = writeln!(
            text,
            "<details><summary>{} more that did not change</summary>\n{}</details>",
            others.len(),
            table(&others, more)
        );
    }
    text
}

fn table(rows: &[&FluentRow], more: More<'_>) -> String {
    let has_way = rows.iter().any(|row| row.direction.is_some());
    let mut text =
        "<div class=\"scroll\"><table>\n<thead><tr><th scope=\"col\">fluent<th scope=\"col\">\
                    expected<th scope=\"col\">twin<th scope=\"col\">measured<th scope=\"col\" \
                    class=\"number\">margin<th scope=\"col\" class=\"number\">margin in the twin"
            .to_owned();
    text += if has_way { "<th scope=\"col\">would have to move" } else { "" };
    text += "</tr></thead>\n<tbody>\n";
    for row in rows {
        let name = escaped(&row.name);
        let name = match more(row) {
            Some(address) => {
                let address = escaped(&address);
                format!("<a href=\"{address}\" aria-label=\"why {name}\">{name}</a>")
            }
            None => name,
        };
        let way = row.direction.as_ref().map(|direction| {
            let by = row.margin.as_ref().map(why::size).unwrap_or_default();
            format!("{} {by} {}", escaped(&direction.object), escaped(&why::to_camera(direction)))
        });
        let _ = writeln!(
            text,
            "<tr{}><th scope=\"row\" class=\"call\">{name}<td>{}<td>{}<td>{}<td class=\"number\">{}\
             <td class=\"number\">{}{}</tr>",
            if differs(row) { " class=\"differs\"" } else { "" },
            row.expected.map_or("", |wanted| truth(Some(wanted))),
            truth(row.twin),
            truth(row.measured),
            margin(row.margin.as_ref(), row.std.as_ref()),
            margin(row.twin_margin.as_ref(), None),
            if has_way { format!("<td>{}", way.unwrap_or_default()) } else { String::new() },
        );
    }
    text += "</tbody></table></div>\n";
    text
}

/// Whether twin and measurement, or promise and measurement, are different answers.
fn differs(row: &FluentRow) -> bool {
    matches!((row.twin, row.measured), (Some(a), Some(b)) if a != b)
        || matches!((row.expected, row.measured), (Some(a), Some(b)) if a != b)
}

/// The pictures of both worlds, side by side; nothing when there are none. `picture` gives an address by
/// `real` and `twin`.
pub fn pictures(when: &str, picture: &dyn Fn(&str) -> Option<String>) -> String {
    let found = ["real", "twin"].map(|whose| (whose, picture(whose)));
    if found.iter().all(|(_, address)| address.is_none()) {
        return String::new();
    }
    let mut text = "<div class=\"pair\">\n".to_owned();
    for (whose, address) in found {
        let shown = match address {
            Some(address) => format!(
                "<img src=\"{}\" alt=\"{when} the step, {whose}\" width=\"1280\" height=\"720\">",
                escaped(&address)
            ),
            None => "<div class=\"missing\">no picture</div>".to_owned(),
        };
        let said = match whose {
            "real" => "camera",
            _ => "twin",
        };
        let _ = writeln!(
            text,
            "<figure>{shown}<figcaption>{said}, {when} the step</figcaption></figure>"
        );
    }
    text += "</div>\n";
    text
}

/// How long a step took and how well the twin foretold it.
pub fn score(record: &StepRecord) -> String {
    format!(
        "<p>{:.1} s of arm time; {}.</p>\n",
        record.interval_s[1] - record.interval_s[0],
        agreement(record)
    )
}

/// The elements that a drawing of a graph is made of.
const DRAWN: &[&str] = &[
    "svg", "title", "defs", "marker", "g", "path", "rect", "circle", "ellipse", "text", "tspan",
    "line", "polygon",
];

/// Whether a drawing, which is read from a file, is made of shapes and words alone: nothing that runs, leads
/// elsewhere, or is HTML.
fn is_drawing(text: &str) -> bool {
    text.split('<').skip(1).all(|tag| {
        let inside = tag.split('>').next().unwrap_or_default();
        let name = inside.trim_start_matches('/').split([' ', '\n', '\t', '\r', '/']).next();
        let is_known = name.is_some_and(|name| DRAWN.contains(&name));
        // Every other piece between quotes is a value; a value that holds the tag's end would hide the rest.
        let is_whole = inside.matches('"').count().is_multiple_of(2) && !inside.contains('\'');
        let bare: Vec<String> = inside
            .split('"')
            .step_by(2)
            .map(|piece| format!(" {}", piece.to_ascii_lowercase()))
            .collect();
        let is_calm = bare
            .iter()
            .flat_map(|piece| piece.split([' ', '\n', '\t', '\r', '\x0c', '/']))
            .all(|word| {
                !word.starts_with("on") && !word.contains("href") && !word.starts_with("style")
            });
        is_known && is_whole && is_calm
    })
}

/// The drawing of the graph, as it may stand in a page; `mark` gives the class of a node by its path.
pub fn graph(drawing: &str, mark: &dyn Fn(&str) -> Option<&'static str>) -> String {
    // The drawing is a document of its own; in a page it begins at its root.
    let root = drawing.find("<svg").map_or(drawing, |at| &drawing[at..]);
    if !is_drawing(root) {
        return "<p class=\"soft\">The run's drawing of its graph is not one of this program's; it is left out.</p>\n".into();
    }
    let mut parts = root.split("data-path=\"");
    let mut text = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let path = part.split('"').next().unwrap_or_default();
        if let Some(class) = mark(path) {
            let _ = write!(text, "class=\"{class}\" ");
        }
        text += "data-path=\"";
        text += part;
    }
    format!(
        "<div class=\"graph\" tabindex=\"0\" role=\"group\" aria-label=\"the And-Or graph\">{text}</div>\n"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_drawing_that_runs_something_is_left_out_of_the_page() {
        let good = "<?xml?><svg viewBox=\"0 0 1 1\"><title>pour(jar, cup)</title><g data-path=\"0/on failure\">\
                    <path d=\"M0 0\" fill=\"#222\"/><text x=\"1\">a on b &lt;c&gt;</text></g></svg>";
        assert!(graph(good, &|_| Some("lit")).contains("class=\"lit\" data-path=\"0/on failure\""));
        for hostile in [
            "<svg><script>alert(1)</script></svg>",
            "<svg onload=\"alert(1)\"/>",
            "<svg/onload=alert(1)>",
            "<svg><g x=\"\"onclick=\"alert(1)\"/></svg>",
            "<svg><g x=\">\" onclick=\"alert(1)\"/></svg>",
            "<svg><g x='>' onclick=alert(1)></g></svg>",
            "<svg><a href=\"javascript:alert(1)\">x</a></svg>",
            "<svg><text style=\"background:url(x)\">x</text></svg>",
            "<svg><foreignObject><img src=x></foreignObject></svg>",
            "<svg></svg><img src=x onerror=alert(1)>",
            "<svg><!-- --><style>*{}</style></svg>",
        ] {
            assert!(!graph(hostile, &|_| None).contains("<svg"), "{hostile}");
        }
        assert!(document("<t>", "").contains("default-src 'none'"));
    }
}
