//! Run folders, settings and lists that were cut short, filled by somebody else, or never made by the program.

use super::{Bench, ENDS, REFUSED, WRONG};

fn records() -> Vec<Vec<u8>> {
    let text = |text: &str| text.as_bytes().to_vec();
    vec![
        vec![],
        text("{"),
        text("null"),
        text("[]"),
        text("{\"task\": 3, \"steps\": {}}"),
        text("{\"task\": \"\x1b[2J\", \"outcome\": \"\x07\", \"steps\": []}"),
        text(
            "{\"task\": \"\\u001b[2J\", \"outcome\": \"success\", \"seed\": -1, \"steps\": [{\"action\": \"\\u001b]0;x\\u0007\"}]}",
        ),
        text("{\"task\": \"t\", \"seed\": 1e999}"),
        format!("{}1{}", "[".repeat(100_000), "]".repeat(100_000)).into_bytes(),
        format!("{{\"task\": \"{}\"}}", "x".repeat(1 << 20)).into_bytes(),
        b"{\"task\": \"\xff\"}".to_vec(),
        vec![0; 1 << 16],
    ]
}

#[test]
fn run_folders_are_told_or_refused() {
    let mut bench = Bench::new("folders");
    for record in records() {
        let files: &[(&str, &[u8])] = &[
            ("runs/20260101-000000-pour/run.json", &record),
            ("runs/20260101-000000-pour/events.jsonl", &record),
        ];
        let run = "runs/20260101-000000-pour";
        bench.case(files, &["replay", run], ENDS);
        bench.case(files, &["report", run], ENDS);
        bench.case(files, &["runs"], ENDS);
        bench.case(files, &["learn", "runs", "--dry"], ENDS);
        bench.case(files, &["gap", run], WRONG);
        bench.case(files, &["vqa", "eval", "runs"], ENDS);
        bench.case(files, &["trials", "merge", "runs"], ENDS);
    }
    for step in ["0", "99999999999", "-1"] {
        bench.case(&[("r/run.json", b"{}")], &["replay", "r", "--step", step], WRONG);
    }
    bench.end(80);
}

#[test]
fn settings_are_taken_or_refused() {
    let mut bench = Bench::new("settings");
    let deep = format!("a = {}1{}\n", "[".repeat(100_000), "]".repeat(100_000));
    let long = format!("a = \"{}\"\n", "x".repeat(1 << 20));
    let texts = [
        "[camera]\nblur_px = 1e9\n",
        "[camera]\nblur_px = -1\n",
        "[camera]\nblur_px = nan\n",
        "blur_px = 1e9\n",
        "[water]\nvolume_ml = 1e12\n",
        "[placement]\n",
        "[[placement]]\n",
        "[\x1b[2J]\nx = 1\n",
        "= 1\n",
        "a = 1\na = 2\n",
        "[placement.fixed.jar]\nx_m = nan\ny_m = 1e308\n",
        &deep,
        &long,
    ];
    for text in texts {
        let files: &[(&str, &[u8])] = &[("l.toml", text.as_bytes())];
        if !text.contains("[placement]\n") {
            bench.case(files, &["-c", "pick(jar)", "--lab", "l.toml"], REFUSED);
        }
        bench.case(files, &["lab", "reveal", "l.toml"], ENDS);
    }
    bench.end(20);
}
