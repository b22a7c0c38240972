//! The page in a real browser, where there is one: keys, the slider, links and forms as a person uses them.
//! Spoken to over the pipe of the `DevTools` protocol, so that nothing has to be installed beside it.

use std::fs::{File, OpenOptions};
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::time::Duration;

use serde_json::{Value, json};
use trueup::arm::Cancel;
use trueup::execution::conduct::Dial;
use trueup::page::Live;
use trueup::trace::{Observer as _, small_jpeg};

use super::live::walk;
use super::watch::{still, watched};
use super::{served, served_with};
use crate::absent::skipped;
use crate::program::Scratch;

const BROWSER: &str = "/usr/bin/chromium";

/// A browser with one page open.
struct Browser {
    child: Child,
    to: File,
    from: BufReader<File>,
    session: String,
    n: u64,
    /// What its console complained of.
    complaints: Vec<String>,
}

impl Browser {
    /// Opens an address; `None` where there is no browser.
    fn open(scratch: &Scratch, url: &str) -> Option<Self> {
        if !Path::new(BROWSER).is_file() {
            skipped(&format!("there is no {BROWSER}"));
            return None;
        }
        let (to, from) = (scratch.path("to"), scratch.path("from"));
        assert!(Command::new("mkfifo").args([&to, &from]).status().unwrap().success());
        let child = Command::new("sh")
            .args(["-c", "exec \"$0\" \"$@\" 3<to 4>from", BROWSER])
            .args(["--headless", "--no-sandbox", "--disable-gpu", "--disable-quic"])
            .args(["--no-first-run", "--disable-background-networking"])
            .args(["--disable-component-update", "--disable-sync", "--remote-debugging-pipe"])
            .arg(format!("--user-data-dir={}", scratch.path("browser").display()))
            .current_dir(scratch.path(""))
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let to = OpenOptions::new().write(true).open(to).unwrap();
        let from = BufReader::new(File::open(from).unwrap());
        let (session, complaints) = (String::new(), Vec::new());
        let mut browser = Self { child, to, from, session, n: 0, complaints };
        let target = browser.call("Target.createTarget", &json!({"url": "about:blank"}));
        let attached = browser.call(
            "Target.attachToTarget",
            &json!({"targetId": target["targetId"], "flatten": true}),
        );
        browser.session.push_str(attached["sessionId"].as_str().unwrap());
        for domain in ["Page.enable", "Runtime.enable", "Log.enable"] {
            browser.call(domain, &json!({}));
        }
        browser.call("Page.navigate", &json!({"url": url}));
        browser.until("document.readyState == 'complete' && !!document.getElementById('main')");
        Some(browser)
    }

    /// Sends a command and returns its result.
    fn call(&mut self, method: &str, params: &Value) -> Value {
        self.n += 1;
        let mut message = json!({"id": self.n, "method": method, "params": params});
        if !self.session.is_empty() {
            message["sessionId"] = self.session.clone().into();
        }
        self.to.write_all(format!("{message}\0").as_bytes()).unwrap();
        loop {
            let mut answer = Vec::new();
            self.from.read_until(0, &mut answer).unwrap();
            assert_eq!(answer.pop(), Some(0), "the browser has gone");
            let answer: Value = serde_json::from_slice(&answer).unwrap();
            if answer["id"] == self.n {
                assert!(answer["error"].is_null(), "{method}: {answer}");
                return answer["result"].clone();
            }
            let event = answer["method"].as_str().unwrap_or_default();
            if matches!(event, "Runtime.exceptionThrown" | "Log.entryAdded") {
                self.complaints.push(answer["params"].to_string());
            }
        }
    }

    fn value(&mut self, script: &str) -> Value {
        let params = json!({"expression": script, "returnByValue": true, "awaitPromise": true});
        self.call("Runtime.evaluate", &params)["result"]["value"].clone()
    }

    /// Waits until a condition of the page holds.
    fn until(&mut self, condition: &str) {
        for _ in 0..600 {
            if self.value(condition) == true {
                return;
            }
            std::thread::sleep(Duration::from_millis(25));
        }
        let text = self.value("location.href + '\\n' + document.body.innerText");
        panic!("never: {condition}\n{}", text.as_str().unwrap_or_default());
    }

    fn press(&mut self, key: &str) {
        let text = if key.len() == 1 { key } else { "" };
        for kind in ["keyDown", "keyUp"] {
            let params = json!({"type": kind, "key": key, "text": text});
            self.call("Input.dispatchKeyEvent", &params);
        }
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

#[test]
fn a_person_answers_by_keys_and_slides_through_a_run() {
    let scratch = Scratch::new("page-browser");
    let page = served(&scratch);
    let url = format!("{}run/20260102-110000-pour/2/after", page.address());
    let Some(mut browser) = Browser::open(&scratch, &url) else { return };
    browser.until("document.documentElement.classList.contains('scripts')");
    browser.until("document.images.length == 2 && [...document.images].every(i => i.naturalWidth)");
    browser.until("document.getElementById('question').textContent.includes('picked up')");
    browser.press("y");
    browser.until("document.getElementById('question').textContent.includes('above the blue cup')");
    browser.press("y");
    browser.until("document.body.innerText.includes('Measured: no (-31 mm ± 1 mm)')");
    for opened in 1..=3 {
        browser.press("h");
        browser
            .until(&format!("document.querySelectorAll('details.hint[open]').length == {opened}"));
    }
    // The name of a fluent leads to why, in place.
    browser.value("document.querySelector('a[aria-label=\"why above(jar, cup)\"]').click()");
    browser.until("document.activeElement.id == 'why'");
    browser.until("document.getElementById('why').innerText.includes('limit 35 mm')");
    browser.press("ArrowLeft");
    browser.until("location.pathname.endsWith('/2/before')");
    let slide = "const s = document.getElementById('slider'); s.focus(); s.value = 0;\
                 s.dispatchEvent(new Event('input', {bubbles: true}))";
    browser.value(slide);
    browser.until("location.pathname.endsWith('/1/before')");
    // The thumb that was held is held still, and the reader is told where it is.
    browser.until("document.activeElement.id == 'slider'");
    browser.until("document.getElementById('says').textContent.includes('before step 1 of 2')");
    browser.value("history.back()");
    browser.until("location.pathname.endsWith('/2/before')");
    // Single keys can be turned off; those of a control that has the focus are its own.
    browser.value("document.activeElement.blur()");
    browser.value("document.getElementById('keys').click()");
    browser.press("ArrowRight");
    browser.value("new Promise(done => setTimeout(done, 300))");
    assert_eq!(browser.value("location.pathname.endsWith('/2/before')"), true);
    assert_eq!(browser.complaints, Vec::<String>::new());
}

#[test]
fn a_person_leads_a_live_run_by_keys() {
    let scratch = Scratch::new("page-browser-live");
    let live = Arc::new(Live::new("pour(jar, cup)".into(), Cancel::default(), Dial::default()));
    let page = served_with(&scratch, Some(live.clone()));
    let run = walk(&live);
    let Some(mut browser) = Browser::open(&scratch, &format!("{}live", page.address())) else {
        live.stop();
        run.join().unwrap();
        return;
    };
    browser.until("document.body.innerText.includes('Next, step 1 of 5')");
    browser.press("Enter");
    browser.until("document.body.innerText.includes('Next, step 2 of 5')");
    browser.press("o");
    browser.until("document.body.innerText.includes('Next, step 5 of 5')");
    browser.press("c");
    assert_eq!(run.join().unwrap(), [1, 2, 3, 4, 5]);
    live.ended("done: pour(jar, cup)");
    browser.until("document.body.innerText.includes('done: pour(jar, cup)')");
    assert_eq!(browser.complaints, Vec::<String>::new());
}

/// A refused form once left its button dead, and said why to screen readers alone.
#[test]
fn a_breakpoint_that_names_nothing_is_refused_where_it_is_seen() {
    let scratch = Scratch::new("page-browser-refused");
    let live = Arc::new(Live::new("pour(jar, cup)".into(), Cancel::default(), Dial::default()));
    let page = served_with(&scratch, Some(live.clone()));
    let run = walk(&live);
    if let Some(mut browser) = Browser::open(&scratch, &format!("{}live", page.address())) {
        browser.until("document.body.innerText.includes('Next, step 1 of 5')");
        let set = |name: &str| {
            format!(
                "document.getElementById('stop-name').value = '{name}';\
                 document.getElementById('set-stop').click()"
            )
        };
        browser.value(&set("Quatsch"));
        browser.until("document.body.innerText.includes('is called Quatsch')");
        browser.until("!document.getElementById('set-stop').disabled");
        browser.value(&set("4"));
        browser.until("document.body.innerText.includes('pauses before')");
        browser.until("document.getElementById('refused').hidden");
    }
    live.stop();
    run.join().unwrap();
}

/// A run that is looked at: pictures change in place, and the report is there after the program is gone.
#[test]
fn a_run_is_looked_at_as_it_goes_and_its_report_outlives_the_page() {
    let scratch = Scratch::new("page-browser-watch");
    let (page, screen, mut onlooker) = watched(&scratch);
    let url = format!("{}watch", page.address());
    let Some(mut browser) = Browser::open(&scratch, &url) else { return };
    let picture = small_jpeg(&image::RgbImage::from_pixel(48, 27, image::Rgb([20, 90, 160])));
    for (number, cup_ml) in [(1, 0.0), (2, 40.0), (3, 90.0)] {
        onlooker.event(&still(number, cup_ml, &picture));
        let shown = format!("document.getElementById('watch-real').src.endsWith('n={number}')");
        browser
            .until(&format!("{shown} && document.getElementById('watch-real').naturalWidth == 48"));
    }
    browser.until("document.querySelector('.curves').textContent.includes('cup 90 mL')");
    scratch.file(
        "runs/now/report.html",
        "<title>kept</title><style>p { color: rgb(1, 2, 3) }</style><p>it",
    );
    screen.ended("done: pour(jar, cup)", Some(scratch.path("runs/now/report.html")));
    // The program waits for this browser, and is gone.
    screen.part();
    drop(page);
    browser.until("document.getElementById('report')?.href.startsWith('blob:')");
    browser.value("location.href = document.getElementById('report').href");
    browser.until("document.title == 'kept' && getComputedStyle(document.querySelector('p')).color == 'rgb(1, 2, 3)'");
    assert!(browser.complaints.is_empty(), "{:?}", browser.complaints);
}
