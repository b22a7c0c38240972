//! The same as JSON, for programs: what `trueup replay --json` says, why, answers, and the live run.

use serde_json::{Value, json};

use crate::http::{Request, Response};
use crate::report::{Failure, why};
use crate::teach::answers;

use super::site::Site;

/// `/api/…`.
pub(super) fn answer(site: &Site, request: &Request, path: &[&str]) -> Response {
    match path {
        ["runs"] => {
            let runs = site.run_index.runs();
            let each = runs.iter().map(|(entry, run)| {
                json!({
                    "number": entry.number,
                    "name": entry.name,
                    "task": run.task,
                    "outcome": run.outcome,
                    "steps": run.steps.len(),
                })
            });
            Response::json(&json!({"runs": each.collect::<Vec<Value>>()}))
        }
        ["progress"] => {
            let tallies = answers::progress(&site.answers());
            let each = tallies.iter().map(|((by, fluent), tally)| {
                json!({"by": by, "fluent": fluent, "right": tally.right, "of": tally.of, "open": tally.open})
            });
            Response::json(&json!({"progress": each.collect::<Vec<Value>>()}))
        }
        ["run", name, rest @ ..] => run(site, request, name, rest),
        _ => {
            Response::text(404, "there are /api/runs, /api/run/NAME[/STEP[/why]] and /api/progress")
        }
    }
}

fn run(site: &Site, request: &Request, name: &str, rest: &[&str]) -> Response {
    let found = site.run_index.entry(name);
    let Some((entry, run)) = found
        .and_then(|entry| Some((site.run_index.run(&entry.dir)?, entry)))
        .map(|(run, entry)| (entry, run))
    else {
        return Response::text(404, "there is no such run");
    };
    let whole = |value: Result<Value, serde_json::Error>| match value {
        Ok(value) => Response::json(&value),
        Err(error) => Response::text(500, &error.to_string()),
    };
    let step = |number: &str| {
        let number = number.parse().ok();
        run.steps.iter().find(|step| Some(step.number) == number)
    };
    match rest {
        [] => whole(serde_json::to_value(&*run)),
        [number] => match step(number) {
            Some(step) => whole(serde_json::to_value(step)),
            None => Response::text(404, "the run has no such step"),
        },
        [number, "why"] => {
            let fluent = request.asked("fluent").unwrap_or_default();
            let Some(step) = step(number) else {
                return Response::text(404, "the run has no such step");
            };
            let told = site.why(&entry, &run, &fluent, |question| {
                let why = why::of_step(question, step.number)?;
                let hints: Vec<String> =
                    why::hints(question, step.number)?.into_iter().map(|(_, hint)| hint).collect();
                Ok::<_, Failure>(json!({"why": why, "hints": hints}))
            });
            match told {
                Ok(told) => Response::json(&told),
                Err(failure) => Response::text(404, &failure.message),
            }
        }
        _ => Response::text(404, "a run has steps, and a step has a `why?fluent=…`"),
    }
}

/// `/live.json`: enough to know whether to look again.
pub(super) fn live(site: &Site) -> Response {
    let Some(live) = &site.live else {
        return Response::text(404, "no run is stepped from here");
    };
    let now = live.now();
    Response::json(&json!({
        "version": now.version,
        "task": live.task(),
        "doing": now.doing,
        "run": now.run(),
        "step": now.number,
        "of": now.of,
        "waits": now.waits,
        "stops": live.stops(),
        "speed_percent": live.dial().percent(),
        "ended": now.ended,
    }))
    .with("Cache-Control", "no-store")
}
