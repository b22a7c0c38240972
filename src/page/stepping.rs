//! The run that is stepped now: what it does, what comes next, and the buttons that let it go on.

use std::fmt::Write as _;

use crate::execution::conduct::{Ahead, Stated};
use crate::report::html::escaped;
use crate::teach::stops::known;

use super::answering::Questions;
use super::frame::View;
use super::live::{Live, Now, Pause, sub_task};
use super::site::Site;
use super::step::{At, Moment, When, conditions, graph, list, pictures};

/// The run that is stepped now.
pub(super) fn view(site: &Site, why: Option<&str>) -> View {
    let Some(live) = &site.live else {
        return View::missing(
            "No run is stepped from here",
            "`trueup teach --page 'pick(jar)'` serves this page with a run to step through.",
        );
    };
    let now = live.now();
    let name = now.run().unwrap_or_default();
    let entry = (!name.is_empty()).then(|| site.run_index.entry(name)).flatten();
    let run = entry.as_ref().and_then(|entry| site.run_index.run(&entry.dir));
    // The last step that is over, unless another has begun since.
    let last = run.as_ref().and_then(|run| run.steps.last());
    // How the run ended would answer questions that are still open.
    let is_open = match (&entry, &run, last) {
        (Some(entry), Some(run), Some(step)) => {
            Questions::of(site, &site.answers(), (entry, run), step).open.is_empty()
        }
        _ => true,
    };
    let mut main =
        format!("<h1 class=\"call\">{}</h1>\n{}", escaped(live.task()), panel(live, &now, is_open));
    match (&entry, &run, last) {
        (Some(entry), Some(run), Some(step)) if now.is_done || now.number <= step.number => {
            let at = At { number: step.number, when: When::After };
            let is_whole = |name: &str| now.pictures.contains(name);
            let moment = Moment {
                site,
                entry,
                run,
                step,
                at,
                here: "/live",
                answers: site.answers(),
                is_whole: &is_whole,
            };
            let _ = writeln!(
                main,
                "<p class=\"where\">after step {}: <b class=\"call\">{}</b> · <a href=\"{}\">look back at all \
                 steps</a></p>",
                step.number,
                escaped(&step.action),
                escaped(&at.path(name))
            );
            main += &moment.body(why);
        }
        _ => main += &running(&now, name),
    }
    let mut view = View::new(format!("live: {}", live.task()), "/live", main);
    view.says = match now.ended {
        Some(_) => "the run is over".to_owned(),
        None => now.doing.clone(),
    };
    view.live = Some(now.version);
    view
}

/// Pictures and graph of a step that is carried out, before there is any record of it.
fn running(now: &Now, name: &str) -> String {
    let Some(dir) = &now.dir else { return String::new() };
    let ahead = match &now.waits {
        Some(Pause::Before(ahead)) => Some(ahead),
        _ => None,
    };
    let number = ahead.map_or(now.number, |ahead| ahead.number).max(1);
    let at = At { number, when: When::Before };
    let mut text = pictures(dir, name, at, &|name| now.pictures.contains(name));
    let lit = match ahead {
        Some(ahead) => Some((ahead.path.as_str(), ahead.action.as_str())),
        None if now.path.is_empty() => None,
        None => Some((now.path.as_str(), now.doing.as_str())),
    };
    text += &graph(dir, lit, &[]);
    text
}

/// What the run does, and the buttons; `is_open` shows how it ended at once.
fn panel(live: &Live, now: &Now, is_open: bool) -> String {
    let mut text = "<section class=\"card\" aria-label=\"the live run\">\n".to_owned();
    if let Some(ended) = &now.ended {
        let _ = write!(
            text,
            "<p class=\"doing\"><b>The run is over.</b></p>\n<details id=\"ending\"{}><summary>How it \
             ended</summary><pre>{}</pre></details>\n</section>\n",
            if is_open { " open" } else { "" },
            escaped(ended)
        );
        return text;
    }
    if !matches!(now.waits, Some(Pause::Before(_))) {
        let _ = writeln!(text, "<p class=\"doing\"><b>{}</b></p>", escaped(&now.doing));
    }
    if let Some(stop) = &now.stop {
        let _ = writeln!(text, "<p>Paused at <span class=\"call\">{}</span>.</p>", escaped(stop));
    }
    if let Some(passed) = &now.passed {
        let _ = writeln!(text, "<p>{}</p>", escaped(passed));
    }
    let mut words = vec![("next", "next step".to_owned(), "Enter")];
    match &now.waits {
        Some(Pause::Before(ahead)) => {
            text += &coming(ahead);
            if let Some(part) = sub_task(ahead) {
                let what = if part.first == ahead.number { "over" } else { "the rest of" };
                let name = escaped(&part.label);
                let said =
                    format!("{what} <span class=\"call\">{name}</span>, to step {}", part.last);
                words.push(("over", said, "o"));
            }
        }
        Some(Pause::Failed { number }) => {
            let _ = writeln!(
                text,
                "<p>Step {number} failed. The next step is what the task says about that; stopping \
                 leaves the arm as it is.</p>"
            );
        }
        None => {}
    }
    let far = if live.stops().is_empty() { "the end" } else { "the next breakpoint" };
    words.push(("continue", format!("continue to {far}"), "c"));
    let off = if now.waits.is_none() { " disabled" } else { "" };
    text += "<div class=\"controls\"><form method=\"post\" action=\"/live\" class=\"buttons\">\n";
    for (word, said, key) in words {
        let _ = writeln!(
            text,
            "<button id=\"go-{word}\" name=\"word\" value=\"{word}\" data-key=\"{key}\" \
             aria-keyshortcuts=\"{key}\"{off}>{said} <kbd>{key}</kbd></button>"
        );
    }
    let stopping = if live.is_stopping() { " disabled" } else { "" };
    let _ = writeln!(
        text,
        "</form>\n<form method=\"post\" action=\"/live\" class=\"speed\"><input type=\"hidden\" \
         name=\"word\" value=\"speed\"><label for=\"percent\">speed of the arm</label> \
         <select id=\"percent\" name=\"percent\">{}</select> <button class=\"quiet\">Set</button></form>\n\
         <form method=\"post\" action=\"/live\" class=\"buttons\"><button id=\"go-stop\" class=\"stop\" \
         name=\"word\" value=\"stop\" data-key=\"s\" aria-keyshortcuts=\"s\" \
         aria-describedby=\"stop-note\"{stopping}>stop the run <kbd>s</kbd></button></form></div>\n\
         <p id=\"stop-note\" class=\"note\">Stopping asks the program for a controlled stop; the arm then \
         holds its position. <b>It is not the emergency stop: that is the red button on the \
         hardware.</b></p>",
        speeds(live.dial().percent())
    );
    text += &breakpoints(live, now);
    if !now.notes.is_empty() {
        let _ = writeln!(
            text,
            "<details id=\"notes\"><summary>notes of the run</summary>{}</details>",
            list("notes", &now.notes)
        );
    }
    text += "</section>\n";
    text
}

/// The breakpoints, one more to be set, and a button to take each away.
fn breakpoints(live: &Live, now: &Now) -> String {
    let Some(ahead) = &now.ahead else {
        return "<p class=\"note\">Breakpoints can be set once the run waits before its first step.</p>\n"
            .to_owned();
    };
    let mut names = known(ahead);
    // What is called, not where it lies.
    names.retain(|name| !name.contains(['/', '.', '(']));
    names.sort_unstable();
    names.dedup();
    let options: Vec<String> =
        names.iter().map(|name| format!("<option value=\"{}\">", escaped(name))).collect();
    let mut text = format!(
        "<form method=\"post\" action=\"/live\" class=\"stops\"><input type=\"hidden\" name=\"word\" \
         value=\"break\"><label for=\"stop-name\">pause before</label> <input id=\"stop-name\" name=\"step\" \
         list=\"stop-names\" size=\"14\" autocomplete=\"off\" placeholder=\"grasp\" required>\
         <datalist id=\"stop-names\">{}</datalist> <button class=\"quiet\" id=\"set-stop\">Set a \
         breakpoint</button></form>\n",
        options.concat()
    );
    let stops = live.stops();
    if !stops.is_empty() {
        text += "<form method=\"post\" action=\"/live\" class=\"stops\"><input type=\"hidden\" name=\"word\" \
                 value=\"clear\">pauses before";
        for stop in stops {
            let stop = escaped(&stop);
            let _ = write!(
                text,
                " <button class=\"quiet\" name=\"step\" value=\"{stop}\" title=\"take it away\"><span \
                 class=\"call\">{stop}</span> <span aria-label=\"take it away\">×</span></button>"
            );
        }
        text += "</form>\n";
    }
    text
}

fn speeds(now: u8) -> String {
    let mut all = vec![5, 10, 25, 50, 75, 100];
    if !all.contains(&now) {
        all.push(now);
        all.sort_unstable();
    }
    let each = all.into_iter().map(|percent| {
        let chosen = if percent == now { " selected" } else { "" };
        format!("<option value=\"{percent}\"{chosen}>{percent} %</option>")
    });
    each.collect()
}

/// The step that is about to begin.
fn coming(ahead: &Ahead) -> String {
    let worth = |stated: &Stated| match stated.truth {
        // What is asked blind is not told before.
        _ if stated.asks => stated.text.clone(),
        Some(true) => format!("{}   (holds now)", stated.text),
        Some(false) => format!("{}   (not yet)", stated.text),
        None => format!("{}   (not measured now)", stated.text),
    };
    let list = |all: &[Stated]| all.iter().map(worth).collect::<Vec<_>>();
    let mut text = format!(
        "<h2>Next, step {} of {}: <span class=\"call\">{}</span></h2>\n",
        ahead.number,
        ahead.of,
        escaped(&ahead.action)
    );
    let inside: Vec<String> =
        ahead.inside().iter().map(|part| format!("in {}", escaped(&part.label))).collect();
    if !inside.is_empty() || ahead.place.is_some() {
        let _ = writeln!(
            text,
            "<p class=\"soft\">{}</p>",
            [inside.join(", "), ahead.place.as_deref().map(escaped).unwrap_or_default()]
                .into_iter()
                .filter(|part| !part.is_empty())
                .collect::<Vec<_>>()
                .join(" · ")
        );
    }
    text += &conditions(&list(&ahead.needs), &list(&ahead.keeps), &list(&ahead.gives));
    text
}
