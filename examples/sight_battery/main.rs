//! The battery of sight: photographs of real tables and pictures painted into them, with the truth known.
//!
//! `cargo run --release --example sight_battery -- real|developed|held|fresh|cuts [--pictures DIR] [--out DIR] [--rows
//! FILE] [--only TEXT]` sees every picture of that part, or those whose names contain TEXT, and prints, for each object that
//! a scene declares, whether it is there, whether it was found, how far off and how sure; at the end how often what was said
//! with how much confidence was right. Half of what is declared is not there. `held` has other backgrounds and other seeds
//! than `developed`, from which constants were taken; the weights of the probability are fitted to `real`, `developed` and
//! the laboratory, and `held` has no part in them. `fresh` has other things in other
//! places, which nothing was fitted to; the photographs beneath are in part the same. `cuts` cuts things out without a scene
//! and compares with the photographs' masks. DIR holds the photographs of clear things, in place of the shared ones. FILE
//! gets what every placement rests on, from which `scripts/sight_weights.py` fits the weights of
//! `alignment::vision::probability`.
#![expect(clippy::print_stdout, reason = "an example talks to a person")]
#![expect(clippy::unwrap_used, reason = "an example that cannot go on may say so by panicking")]
#![expect(clippy::disallowed_methods, reason = "how long it takes is one of the scores")]

use std::path::{Path, PathBuf};
use std::time::Instant;

use cases::{Case, Forms};
use trueup::alignment::vision::{Options, Sighting, annotate, see};
use trueup::world::Material;

#[path = "../../tests/absent.rs"]
mod absent;
mod cases;
mod cuts;
mod forms;
mod photos;
mod score;
mod trace;
#[path = "../../tests/alignment_vision/visp.rs"]
#[expect(dead_code, reason = "shared with the tests, which use more of it")]
mod visp;

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let after = |name: &str| {
        let at = arguments.iter().position(|a| a == name)?;
        Some(PathBuf::from(arguments.get(at + 1)?))
    };
    let folder = after("--pictures").or_else(|| absent::public("cleargrasp_transparent"));
    let desk = absent::public("visp_cube_cylinder");
    let out = after("--out");
    let only = after("--only").map(|only| only.to_string_lossy().into_owned());
    let part = arguments.first().map_or("real", String::as_str);
    if part == "cuts" {
        if let Some(folder) = folder {
            cuts::all(&folder);
        }
        return;
    }
    let mut tally = score::Tally::default();
    let mut seconds = Vec::new();
    let mut run = |case: Case| {
        if only.as_ref().is_some_and(|only| !case.name.contains(only)) {
            return;
        }
        let start = Instant::now();
        let seen = see(&case.image, &case.scene.camera, &case.scene, &Options::default()).unwrap();
        seconds.push(start.elapsed().as_secs_f64());
        for (k, sighting) in seen.iter().enumerate() {
            let is_clear = case.scene.objects[k].material == Material::Transparent;
            tally.add(&case.name, sighting, &case.truth[k], is_clear);
        }
        if let Some(out) = &out {
            write(&case, &seen, out);
        }
    };
    match part {
        "developed" => developed(folder.as_deref(), &mut run),
        "held" => held(folder.as_deref(), desk.as_deref(), &mut run),
        "fresh" => fresh(folder.as_deref(), desk.as_deref(), &mut run),
        "boxes" => real(folder.as_deref(), None, Forms::Boxes, &mut run),
        "clear" => real(folder.as_deref(), None, Forms::Own, &mut run),
        _ => real(folder.as_deref(), desk.as_deref(), Forms::Own, &mut run),
    }
    tally.print();
    if let Some(rows) = after("--rows") {
        std::fs::write(rows, tally.evidence()).unwrap();
    }
    seconds.sort_by(f64::total_cmp);
    if let (Some(most), Some(middle)) = (seconds.last(), seconds.get(seconds.len() / 2)) {
        println!("{} pictures, seconds each: median {middle:.2}, most {most:.2}", seconds.len());
    }
}

/// The photographs as they are.
fn real(folder: Option<&Path>, desk: Option<&Path>, declared: Forms, run: &mut dyn FnMut(Case)) {
    for frame in (0..=200).step_by(20) {
        desk.into_iter().flat_map(|d| cases::desk(d, frame)).for_each(&mut *run);
    }
    for scene in photos::CLEAR {
        for twin in ["opaque", "transparent"] {
            folder
                .into_iter()
                .flat_map(|f| cases::clear(f, scene, twin, declared))
                .for_each(&mut *run);
        }
    }
}

/// The pictures that constants are taken from.
fn developed(folder: Option<&Path>, run: &mut dyn FnMut(Case)) {
    grounds(folder, &[("080", "opaque"), ("123", "opaque"), ("130", "transparent")], 1000, run);
    for k in 0..24 {
        run(cases::painted(&cases::own_ground(k % 3, 2000 + k as u64), 2000 + k as u64));
    }
}

/// The pictures that are looked at once, at the end.
fn held(folder: Option<&Path>, desk: Option<&Path>, run: &mut dyn FnMut(Case)) {
    grounds(folder, &[("153", "opaque"), ("153", "transparent")], 5000, run);
    for (frame, seed) in [(0, 5100_u64), (60, 5101), (100, 5102), (160, 5103), (200, 5104)] {
        let Some(desk) = desk else { continue };
        let ground = photos::desk(desk, frame);
        run(cases::painted(&ground, seed));
        folder
            .and_then(|f| cases::pasted(f, &ground, seed as usize % 3, seed))
            .into_iter()
            .for_each(&mut *run);
    }
    for k in 0..24 {
        run(cases::painted(&cases::own_ground(3 + k % 2, 6000 + k as u64), 6000 + k as u64));
    }
}

/// Pictures that no weight or constant was fitted to: other things on all kinds of tables of our own, on frames of the
/// sequence that were not painted into, and on photographs whose twins were.
fn fresh(folder: Option<&Path>, desk: Option<&Path>, run: &mut dyn FnMut(Case)) {
    grounds(
        folder,
        &[("080", "transparent"), ("123", "transparent"), ("130", "opaque")],
        9000,
        run,
    );
    for (frame, seed) in [(20, 9500_u64), (40, 9501), (80, 9502), (120, 9503), (140, 9504)] {
        if let Some(desk) = desk {
            run(cases::painted(&photos::desk(desk, frame), seed));
        }
    }
    for k in 0..20 {
        run(cases::painted(&cases::own_ground(k % 5, 9600 + k as u64), 9600 + k as u64));
    }
}

/// Paints and pastes into some of the photographs of clear things.
fn grounds(
    folder: Option<&Path>,
    which: &[(&'static str, &str)],
    seed: u64,
    run: &mut dyn FnMut(Case),
) {
    for (n, (scene, twin)) in which.iter().enumerate() {
        let Some(folder) = folder else { return };
        let Some(ground) = photos::Clear::read(folder, scene).and_then(|p| p.ground(folder, twin))
        else {
            println!("# the photograph {scene} {twin} is not here");
            continue;
        };
        for k in 0..8 {
            run(cases::painted(&ground, seed + 100 * n as u64 + k));
        }
        for k in 0..4 {
            let pasted =
                cases::pasted(folder, &ground, k % 3, seed + 50 + 100 * n as u64 + k as u64);
            pasted.into_iter().filter(|_| *scene != "080").for_each(&mut *run);
        }
    }
}

fn write(case: &Case, seen: &[Sighting], out: &Path) {
    std::fs::create_dir_all(out).unwrap();
    let name = case.name.replace([' ', ','], "-");
    case.image.save(out.join(format!("{name}.png"))).unwrap();
    let said = serde_json::json!({ "scene": case.scene, "truth": case.truth });
    std::fs::write(out.join(format!("{name}.case")), said.to_string()).unwrap();
    annotate(&case.image, seen).save(out.join(format!("{name}-seen.png"))).unwrap();
}
