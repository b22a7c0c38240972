//! The page in a real browser, where there is one: it runs its script, changes pages in place, and leaves no
//! complaint in the console.

use std::path::Path;
use std::process::{Command, Stdio};

use super::{get, host, served};
use crate::program::Desk;

const BROWSER: &str = "/usr/bin/chromium";

/// Returns the document after the page's own script has run for a while, and what the browser complained of.
fn loaded(desk: &Desk, url: &str) -> Option<(String, String)> {
    if !Path::new(BROWSER).is_file() {
        println!("skipped: there is no {BROWSER}");
        return None;
    }
    let output = Command::new(BROWSER)
        .args(["--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run"])
        .args(["--disable-background-networking", "--disable-component-update", "--disable-sync"])
        .args(["--enable-logging=stderr", "--virtual-time-budget=3000", "--dump-dom"])
        .arg(format!("--user-data-dir={}", desk.path("browser").display()))
        .arg(url)
        .stdin(Stdio::null())
        .output()
        .unwrap();
    let complaints: Vec<String> = String::from_utf8_lossy(&output.stderr)
        .lines()
        .filter(|line| line.contains("CONSOLE"))
        .map(str::to_owned)
        .collect();
    Some((String::from_utf8(output.stdout).unwrap(), complaints.join("\n")))
}

#[test]
fn the_script_runs_and_the_policy_lets_it() {
    let desk = Desk::new("page-browser");
    let page = served(&desk);
    let url = format!("{}run/20260102-110000-pour/2/after", page.address());
    let Some((document, complaints)) = loaded(&desk, &url) else { return };
    assert_eq!(complaints, "");
    for part in
        ["class=\"scripts\"", "id=\"say-y\"", "data-key=\"y\"", "id=\"slider\"", "class=\"lit\""]
    {
        assert!(document.contains(part), "{part} is missing: {document}");
    }
    // What comes next has been fetched ahead, and the page still answers.
    assert_eq!(get(&host(&page), "/").status, 200);
}
