//! The list of runs, and how far each person has come.

use std::fmt::Write as _;

use crate::http::encoded;
use crate::report::html::{self, escaped};
use crate::teach::answers::{self, TRAINEE};
use crate::workcell::archive;

use super::frame::View;
use super::site::Site;

pub(super) fn view(site: &Site) -> View {
    let mut main = "<h1>Runs</h1>\n".to_owned();
    let entries = site.run_index.entries();
    let root = site.run_index.root().display().to_string();
    if entries.is_empty() {
        let _ = writeln!(
            main,
            "<p>No run is kept in <code>{}</code> yet. <code>trueup -c 'pour(jar, cup)'</code> makes one; \
             <code>--record DIR</code> names another folder.</p>",
            escaped(&root)
        );
        return View::new("Runs", "/", main);
    }
    let _ = writeln!(
        main,
        "<p class=\"soft\">in <code>{}</code>, the newest first</p>",
        escaped(&root)
    );
    main += "<div class=\"scroll\"><table class=\"runs\">\n<thead><tr><th scope=\"col\">run<th scope=\"col\">task\
             <th scope=\"col\">with<th scope=\"col\">ended<th scope=\"col\" class=\"number\">steps\
             <th scope=\"col\">twin agrees<th scope=\"col\">your answers</tr></thead>\n<tbody>\n";
    let by = site.by();
    let mine: Vec<_> = site.answers().into_iter().filter(|answered| answered.by == by).collect();
    for entry in entries.iter().rev() {
        let Some(run) = site.run_index.run(&entry.dir) else {
            let _ = writeln!(
                main,
                "<tr><td class=\"number\">{}<td colspan=\"6\">{} cannot be read</tr>",
                entry.number,
                escaped(&entry.name)
            );
            continue;
        };
        let (of, agree) = run.agreeing();
        let rows =
            run.steps.iter().flat_map(|step| step.fluents.iter().map(move |row| (step, row)));
        let asked: Vec<_> = rows.filter(|(_, row)| row.ask.is_some()).collect();
        let is_done = |step: usize, fluent: &str| {
            let same = |one: &&answers::Answered| {
                one.run == entry.name && one.step == step && one.fluent == fluent
            };
            mine.iter().find(same).is_some()
        };
        let done = asked.iter().filter(|(step, row)| is_done(step.number, &row.name)).count();
        let _ = writeln!(
            main,
            "<tr><td class=\"number\">{}<th scope=\"row\"><a class=\"call\" href=\"/run/{}/1/before\">{}</a>\
             <div class=\"soft\">{}</div><td>{}<td class=\"truth\">{}<td class=\"number\">{}<td>after {agree} of {of}\
             <td>{done} of {}</tr>",
            entry.number,
            encoded(&entry.name),
            escaped(&run.task),
            escaped(&entry.name),
            escaped(&run.robot),
            html::ending(archive::standing(&entry.dir, &run)),
            of,
            asked.len()
        );
    }
    main += "</tbody></table></div>\n";
    main += &progress(site);
    View::new("Runs", "/", main)
}

/// How often each person was right about each fluent.
pub(super) fn progress(site: &Site) -> String {
    let answers = site.answers();
    let by = site.by();
    let mut text = format!(
        "<section class=\"card\" aria-labelledby=\"progress\"><h2 id=\"progress\">Progress</h2>\n\
         <form method=\"post\" action=\"/who\" class=\"who\"><label for=\"name\">who answers</label> \
         <input id=\"name\" name=\"name\" value=\"{}\" placeholder=\"trainee\" autocomplete=\"off\" \
         maxlength=\"40\"> <button>Change</button></form>\n",
        escaped(name_of(&by))
    );
    if answers.is_empty() {
        text += "<p class=\"soft\">No question has been answered yet.</p></section>\n";
        return text;
    }
    text += "<div class=\"scroll\"><table><thead><tr><th scope=\"col\">person<th scope=\"col\">fluent<th scope=\"col\">\
             as geometry says<th scope=\"col\">geometry could not tell</tr></thead>\n<tbody>\n";
    for ((who, fluent), tally) in answers::progress(&answers) {
        let bar = match tally.of {
            0 => "<span class=\"soft\">none counted yet</span>".to_owned(),
            of => format!(
                "<meter min=\"0\" max=\"{of}\" value=\"{right}\" aria-hidden=\"true\"></meter> {right} of {of}",
                right = tally.right
            ),
        };
        let _ = writeln!(
            text,
            "<tr><td>{}<th scope=\"row\" class=\"call\">{}<td class=\"number\">{bar}<td class=\"number\">{}</tr>",
            escaped(match name_of(&who) {
                "" => "trainee",
                name => name,
            }),
            escaped(&fluent),
            tally.open
        );
    }
    text += "</tbody></table></div></section>\n";
    text
}

/// Returns the name in `person:trainee:anna`.
fn name_of(by: &str) -> &str {
    by.strip_prefix(TRAINEE).map_or(by, |rest| rest.trim_start_matches(':'))
}
