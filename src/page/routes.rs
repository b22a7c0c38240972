//! Which request is answered by what.

use super::frame::{self, View};
use super::live::{Unset, Wish};
use super::site::Site;
use super::step::{At, When};
use super::{answering, api, overview, quiz, step, stepping, watching};
use crate::files::read;
use crate::http::{Request, Response, encoded};
use crate::workcell::picture;

/// What a picture is.
pub(super) const JPEG: &str = "image/jpeg";
const PNG: &str = "image/png";

impl Site {
    /// Answers a request.
    pub(super) fn answer(&self, request: &Request) -> Response {
        if !request.is_local() {
            let line = "this page answers this machine only, under the address it was given";
            return frame::guarded(Response::text(403, line), &request.path);
        }
        let path: Vec<&str> = request.path.split('/').skip(1).collect();
        let response = if request.method == "POST" {
            self.told(request, &path)
        } else {
            self.asked(request, &path)
        };
        frame::guarded(response, &request.path)
    }

    fn asked(&self, request: &Request, path: &[&str]) -> Response {
        if let Some(file) = frame::file(&request.path) {
            return file;
        }
        if let (Some(screen), ["watch", rest @ ..]) = (&self.screen, path)
            && let Some(answer) = watching::answer(screen, request, rest)
        {
            return answer;
        }
        let view = match path {
            ["watch"] if let Some(screen) = &self.screen => watching::view(screen),
            [""] => overview::view(self),
            ["quiz"] => quiz::view(self, request),
            ["live"] => stepping::view(self, request.asked("why").as_deref()),
            ["live.json"] => return api::live(self),
            ["api", rest @ ..] => return api::answer(self, request, rest),
            ["run", run, "frames", name] => return self.picture(run, name),
            ["run", run] => {
                return Response::see_other(&format!("/run/{}/1/before", encoded(run)));
            }
            ["run", run, number, when] => {
                let at = number.parse().ok().zip(When::parse(when));
                match (self.run_index.entry(run), at) {
                    (Some(entry), Some((number, when))) => {
                        let why = request.asked("why");
                        step::view(self, &entry, At { number, when }, why.as_deref())
                    }
                    (None, _) => {
                        View::missing("There is no such run", "The list has all there are.")
                    }
                    (_, None) => {
                        View::missing("There is no such step", "The run has all there are.")
                    }
                }
            }
            _ => View::missing("There is no such page", "The menu above has all there are."),
        };
        frame::page(self, &view)
    }

    /// Does what a form asks for, and sends the browser on.
    fn told(&self, request: &Request, path: &[&str]) -> Response {
        // A form of this page says where it came from; what does not is no browser's form.
        if request.header("origin").is_none() {
            return Response::text(403, "a form must say which page it is from");
        }
        let back = request.sent("back").filter(|back| is_ours(back));
        let back = back.unwrap_or_else(|| "/".to_owned());
        match path {
            ["answer"] => match answering::keep(self, request) {
                Ok(()) => Response::see_other(&back),
                Err(refusal) => refusal,
            },
            ["show"] => {
                let number = request.sent("step").and_then(|step| step.parse().ok());
                if let (Some(run), Some(number)) = (request.sent("run"), number) {
                    self.saw(&run, number);
                }
                Response::see_other(&back)
            }
            ["asks"] => {
                let asks = request.sent("asks").as_deref() == Some("yes");
                self.ask(asks);
                Response::see_other(&back)
            }
            ["who"] => {
                let name = request.sent("name").unwrap_or_default();
                self.answered_by(&name);
                Response::see_other(&back)
            }
            ["live"] => self.wished(request),
            _ => Response::text(404, "there is no such form"),
        }
    }

    fn wished(&self, request: &Request) -> Response {
        let Some(live) = &self.live else {
            return Response::text(404, "no run is stepped from here");
        };
        let word = request.sent("word").unwrap_or_default();
        match (word.as_str(), Wish::parse(&word)) {
            ("stop", _) => live.stop(),
            ("speed", _) => {
                let percent = request.sent("percent").and_then(|percent| percent.parse().ok());
                let Some(percent) = percent.filter(|percent| (1..=100).contains(percent)) else {
                    return Response::text(400, "a speed is a number of percent from 1 to 100");
                };
                live.dial().turn(percent);
            }
            ("break", _) => {
                let name = request.sent("step").unwrap_or_default();
                let name = name.trim();
                if name.is_empty() {
                    return Response::text(400, "a breakpoint names a step, such as grasp");
                }
                if let Err(unset) = live.set_stop(name) {
                    return refused(name, &unset);
                }
            }
            ("clear", _) => live.clear_stop(&request.sent("step").unwrap_or_default()),
            (_, Some(wish)) => {
                if !live.wish(wish) {
                    return Response::text(409, "the run does not wait now");
                }
            }
            _ => {
                return Response::text(
                    400,
                    "say next, over, continue, stop, speed, break or clear",
                );
            }
        }
        Response::see_other("/live")
    }

    fn picture(&self, run: &str, name: &str) -> Response {
        let known = name.strip_suffix(".jpg").or_else(|| name.strip_suffix(".png"));
        let known = known.filter(|name| is_picture(name));
        let dir = self.dir(run);
        let known = known.filter(|name| self.is_whole(run, name));
        let (Some(name), Some(dir)) = (known, dir) else {
            return Response::text(404, "there is no such picture");
        };
        let file = picture::file(&dir, name);
        let kind = if file.extension().is_some_and(|end| end == "png") { PNG } else { JPEG };
        match read::bytes(&file, read::DATA) {
            // Pictures of a step are written once.
            Ok(bytes) => {
                Response::new(200, kind, bytes).with("Cache-Control", "private, max-age=3600")
            }
            Err(_) => Response::text(404, "there is no such picture"),
        }
    }
}

/// Says why a breakpoint was not set.
fn refused(name: &str, unset: &Unset) -> Response {
    match unset {
        Unset::NoPlan => Response::text(
            409,
            "nothing is planned yet; the run waits before its first step, and takes breakpoints then",
        ),
        Unset::NoStep(near) => {
            let help = match near {
                Some(near) => format!(": did you mean {near}?"),
                None => "; the field lists those there are".to_owned(),
            };
            Response::text(400, &format!("no step from here on is called {name}{help}"))
        }
    }
}

/// Whether a name is one that the recorder gives: `03-after-real`.
fn is_picture(name: &str) -> bool {
    let parts: Vec<&str> = name.split('-').collect();
    let [number, when, whose] = parts[..] else { return false };
    !number.is_empty()
        && number.bytes().all(|byte| byte.is_ascii_digit())
        && When::parse(when).is_some()
        && matches!(whose, "real" | "twin")
}

/// Whether an address is a path of this site.
fn is_ours(back: &str) -> bool {
    back.starts_with('/')
        && !back.starts_with("//")
        && !back.contains('\\')
        && !back.chars().any(char::is_control)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_the_recorder_writes_is_a_picture() {
        assert!(is_picture("03-after-real") && is_picture("103-before-twin"));
        for other in ["", "..", "-after-real", "03-after-real-x", "a-after-real", "03-during-real"]
        {
            assert!(!is_picture(other), "{other}");
        }
    }

    #[test]
    fn a_form_sends_nobody_elsewhere() {
        assert!(is_ours("/run/a/1/after?why=x"));
        for other in ["", "//evil.example", "http://evil.example", "/\\evil.example", "/a\r\nb"] {
            assert!(!is_ours(other), "{other}");
        }
    }
}
