//! What every page of the site has around it.

use crate::http::Response;
use crate::report::html::escaped;

use super::site::Site;

/// Nothing from outside, nothing inline, no frame around it.
const POLICY: &str = "default-src 'none'; img-src 'self'; style-src 'self'; script-src 'self'; \
                      connect-src 'self'; form-action 'self'; base-uri 'none'; frame-ancestors 'none'";

/// As [`POLICY`], for a run that is looked at: the report on it, with its own style and pictures inside, is opened from
/// there.
const WITH_REPORT: &str = "default-src 'none'; img-src 'self' data:; style-src 'self' 'unsafe-inline'; \
                           media-src data:; script-src 'self'; connect-src 'self'; form-action 'self'; \
                           base-uri 'none'; frame-ancestors 'none'";

/// The files that pages refer to, by path.
const FILES: &[(&str, &str, &str)] = &[
    ("/look.css", "text/css; charset=utf-8", crate::report::html::LOOK),
    ("/page.css", "text/css; charset=utf-8", include_str!("page.css")),
    ("/page.js", "text/javascript; charset=utf-8", include_str!("page.js")),
    ("/icon.svg", "image/svg+xml", include_str!("icon.svg")),
];

/// A page to be.
pub(super) struct View {
    pub(super) status: u16,
    pub(super) title: String,
    /// Which entry of the menu it belongs to, by its path.
    pub(super) menu: &'static str,
    /// What a screen reader is told when the page changes in place.
    pub(super) says: String,
    /// The version of the live run that it shows, to be looked at again when that changes.
    pub(super) live: Option<u64>,
    /// Whether it is read anew every few seconds where there are no scripts.
    pub(super) reads_again: bool,
    /// Pictures that are likely to be wanted next.
    pub(super) soon: Vec<String>,
    pub(super) main: String,
}

impl View {
    pub(super) fn new(title: impl Into<String>, menu: &'static str, main: String) -> Self {
        let title = title.into();
        let (says, soon) = (title.clone(), Vec::new());
        Self { status: 200, title, menu, says, live: None, reads_again: false, soon, main }
    }

    /// A page that says what is not there.
    pub(super) fn missing(what: &str, help: &str) -> Self {
        let main = format!("<h1>{}</h1>\n<p>{}</p>\n", escaped(what), escaped(help));
        Self { status: 404, ..Self::new(what, "", main) }
    }
}

/// Returns one of the files that pages refer to.
pub(super) fn file(path: &str) -> Option<Response> {
    let (_, kind, text) = FILES.iter().find(|(known, ..)| *known == path)?;
    Some(Response::new(200, kind, *text))
}

/// Adds what keeps other pages out of what is at a path.
pub(super) fn guarded(response: Response, path: &str) -> Response {
    let policy = if path.starts_with("/watch") { WITH_REPORT } else { POLICY };
    response
        .with("Content-Security-Policy", policy)
        .with("X-Content-Type-Options", "nosniff")
        .with("Referrer-Policy", "no-referrer")
        .with("Cross-Origin-Resource-Policy", "same-origin")
}

/// Puts a view into its frame.
pub(super) fn page(site: &Site, view: &View) -> Response {
    let mut menu = vec![("/", "Runs"), ("/quiz", "Quiz")];
    if site.live.is_some() {
        menu.insert(0, ("/live", "Live"));
    }
    if site.screen.is_some() {
        menu.insert(0, ("/watch", "Live"));
    }
    let links: Vec<String> = menu
        .into_iter()
        .map(|(path, name)| {
            let here = if path == view.menu { " aria-current=\"page\"" } else { "" };
            format!("<a href=\"{path}\"{here}>{name}</a>")
        })
        .collect();
    let live = view.live.map(|version| format!(" data-live=\"{version}\"")).unwrap_or_default();
    // Without scripts a page that shows a live run reads itself again.
    let again = if view.live.is_some() || view.reads_again {
        "<noscript><meta http-equiv=\"refresh\" content=\"3\"></noscript>\n"
    } else {
        ""
    };
    let text = format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <title>{title} · trueup</title>\n{again}\
         <link rel=\"icon\" href=\"/icon.svg\">\n<link rel=\"stylesheet\" href=\"/look.css\">\n\
         <link rel=\"stylesheet\" href=\"/page.css\">\n<script src=\"/page.js\" defer></script>\n\
         </head>\n<body>\n<a class=\"skip\" href=\"#main\">Skip to the content</a>\n\
         <header><nav aria-label=\"pages\">{}</nav></header>\n\
         <main id=\"main\" tabindex=\"-1\" data-says=\"{}\" data-soon=\"{}\"{live}>\n{}</main>\n\
         <p id=\"says\" class=\"aside\" role=\"status\"></p>\n\
         <p id=\"refused\" role=\"alert\" hidden></p>\n\
         <footer><p class=\"js\"><label><input type=\"checkbox\" id=\"keys\" checked> single keys: \
         <kbd>y</kbd> <kbd>n</kbd> <kbd>u</kbd> answer, <kbd>h</kbd> hint, <kbd>←</kbd> <kbd>→</kbd> \
         step{}</label></p>\n\
         <p>Served by this machine to this machine; nothing leaves it. Looking never moves the arm.</p>\
         </footer>\n</body>\n</html>\n",
        links.join("\n"),
        escaped(&view.says),
        escaped(&view.soon.join(" ")),
        view.main,
        if site.live.is_some() {
            "; live run: <kbd>Enter</kbd> next, <kbd>o</kbd> over, <kbd>c</kbd> continue, \
             <kbd>s</kbd> stop"
        } else {
            ""
        },
        title = escaped(&view.title),
    );
    let response = Response::new(view.status, "text/html; charset=utf-8", text);
    response.with("Cache-Control", "no-store")
}
