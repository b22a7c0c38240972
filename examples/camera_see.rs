//! Seeing on real photographs: finds the `ViSP` cube and tube, and prepares `trueup camera see` for them.
//!
//! `cargo run --example camera_see -- OUT` reads the sequence in place, writes to OUT the scene
//! (`visp.task`), a calibration per frame (`calibration_0000.json`: the table is the sheet the solids stand
//! on, which is lifted a little on the way), and a picture of what was seen; it prints the distance to the
//! reference. Then: `trueup camera see image0080.png --scene OUT/visp.task
//! --calibration OUT/calibration_0080.json`.
//!
//! `cargo run --example camera_see -- lab 30 [OUT]` does the same for the laboratory: thirty of them, nine
//! kinds of photograph each, truth known; a table of how far off, how often found, and how honest the
//! standard deviations are. OUT also gets `rows.csv`, what each placement rests on (`scripts/sight_weights.py`).
#![expect(clippy::print_stdout, reason = "an example talks to a person")]
#![expect(clippy::unwrap_used, reason = "an example that cannot go on may say so by panicking")]

use std::collections::BTreeMap;
use std::f64::consts::FRAC_PI_2;
use std::path::Path;

use lab_photos::{Bench, Kind, Photo, off};
use nalgebra::Vector3;
use trueup::alignment::vision::{Options, Sighting, annotate, see};
use trueup::world::Material;

#[path = "../tests/absent.rs"]
mod absent;
#[path = "../tests/kitchen.rs"]
#[expect(dead_code, reason = "shared with the tests, which use more of it")]
mod kitchen;
#[path = "../tests/alignment_vision/lab_photos.rs"]
mod lab_photos;
#[path = "sight_battery/score.rs"]
#[expect(dead_code, reason = "shared with the battery, which uses more of it")]
mod score;
#[path = "../tests/alignment_vision/visp.rs"]
mod visp;

/// The scene in the task language; the camera is a guess that the calibration replaces.
const SCENE: &str = "\
/// A printed cube and a grey tube, taller than the picture, on a sheet of paper on a desk.
scene visp {
    table: Surface = box(80 cm, 80 cm, 2 cm) at (0 m, 0.10 m) { colour \"#aaaaaa\" }
    cube:  Block   = cuboid(84 mm, 84 mm, 84 mm) { mass 200 g  looks \"printed cube\"  colour \"#808080\" }
    tube:  Block   = cylinder(radius 40 mm, height 350 mm) { mass 200 g  looks \"grey tube\"  colour \"#808080\" }
    camera still { image 640 x 480  focal ~ 545 px  at (0 m, -0.40 m, 0.43 m) looking (0 m, 0 m, 0 m) }
    robot gen3_2f85 at (0 m, 0 m, 0 m)
}
";

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    if arguments.first().is_some_and(|a| a == "lab") {
        let n = arguments.get(1).and_then(|n| n.parse().ok()).unwrap_or(3);
        lab(n, arguments.get(2).map(Path::new));
    } else {
        visp(arguments.first().map(Path::new));
    }
}

/// Sees photographs of `n` laboratories, nine each, and prints how far off and how sure.
fn lab(n: u64, out: Option<&Path>) {
    let symmetry = [FRAC_PI_2, 0.0];
    let mut rows: BTreeMap<(Kind, usize), Vec<Row>> = BTreeMap::new();
    let mut tally = score::Tally::default();
    for seed in 1..=n {
        let bench = Bench::new(seed);
        for kind in Kind::ALL {
            let photo = bench.photo(kind);
            let seen = photo.see();
            if let Some(out) = out {
                let name = format!("{seed:02}-{}", kind.words().replace(' ', "-"));
                write(&photo, &seen, out, &name);
            }
            for (idx, s) in seen.iter().enumerate() {
                let off = photo.truth[idx].and_then(|truth| off(s, truth, symmetry[idx]));
                let place: Vec<[f64; 2]> = photo.truth[idx].iter().map(|t| [t[0], t[1]]).collect();
                let is_clear = photo.scene.objects[idx].material == Material::Transparent;
                tally.keep(&format!("lab{seed:02}-{}", kind.words()), s, &place, is_clear);
                let there = photo.truth[idx].is_some();
                let bad = s.found != there || off.is_some_and(|o| o.0 > 2.0 || o.1 > 0.02);
                if bad {
                    println!(
                        "# seed {seed} {} {}: {:?} truth {:?} saw {:?} ± {:.1} mm, confidence {:.2}, {:?}",
                        kind.words(),
                        s.name,
                        off,
                        photo.truth[idx],
                        s.world_from_object.map(|p| (p.origin().x, p.origin().y, p.yaw())),
                        1e3 * s.std,
                        s.confidence,
                        s.reason
                    );
                }
                let row = Row { there, found: s.found, off, std: s.std, yaw_std: s.yaw_std };
                rows.entry((kind, idx)).or_default().push(row);
            }
        }
    }
    if let Some(out) = out {
        std::fs::write(out.join("rows.csv"), tally.evidence()).unwrap();
    }
    println!(
        "{:15} {:3} {:>9} {:>5} {:>23} {:>9} {:>13}",
        "photograph", "", "found", "false", "mm median / p95 / max", "yaw deg", "z rms pos yaw"
    );
    let mut all = Vec::new();
    for ((kind, idx), rows) in &rows {
        print_row(kind.words(), ["jar", "cup"][*idx], rows);
        all.extend(rows.iter().map(|row| (*idx, *row)));
    }
    for (idx, name) in ["jar", "cup"].iter().enumerate() {
        let mine: Vec<Row> = all.iter().filter(|r| r.0 == idx).map(|r| r.1).collect();
        print_row("all", name, &mine);
    }
}

/// Writes a photograph, its calibration with the truth, what the arm hides, and what was seen.
fn write(photo: &Photo, seen: &[Sighting], out: &Path, name: &str) {
    std::fs::create_dir_all(out).unwrap();
    let calibration = serde_json::json!({ "camera": photo.camera, "truth": photo.truth });
    let text = serde_json::to_string_pretty(&calibration).unwrap();
    std::fs::write(out.join(format!("{name}.json")), text).unwrap();
    photo.image.save(out.join(format!("{name}.png"))).unwrap();
    photo.ignore.save(out.join(format!("{name}-ignore.png"))).unwrap();
    annotate(&photo.image, seen).save(out.join(format!("{name}-seen.png"))).unwrap();
}

/// What one look at one object came to.
#[derive(Debug, Clone, Copy)]
struct Row {
    there: bool,
    found: bool,
    /// mm and rad from the truth.
    off: Option<(f64, f64)>,
    std: f64,
    yaw_std: f64,
}

fn print_row(what: &str, name: &str, rows: &[Row]) {
    let there = rows.iter().filter(|r| r.there).count();
    let found = rows.iter().filter(|r| r.there && r.found).count();
    let wrong = rows.iter().filter(|r| !r.there && r.found).count();
    let mut mm: Vec<f64> = rows.iter().filter_map(|r| Some(r.off?.0)).collect();
    let mut turn: Vec<f64> = rows.iter().filter_map(|r| Some(r.off?.1)).collect();
    mm.sort_by(f64::total_cmp);
    turn.sort_by(f64::total_cmp);
    let at = |v: &[f64], q: f64| {
        v.get(((v.len() as f64 - 1.0) * q).round().max(0.0) as usize).copied().unwrap_or(0.0)
    };
    let rms = |z: Vec<f64>| (z.iter().map(|z| z * z).sum::<f64>() / z.len().max(1) as f64).sqrt();
    // The distance has two parts, each with at most the worst direction's deviation.
    let z =
        rms(rows.iter().filter_map(|r| Some(r.off?.0 / (1e3 * r.std * 2.0_f64.sqrt()))).collect());
    let z_yaw = rms(rows
        .iter()
        .filter(|r| r.yaw_std > 0.0)
        .filter_map(|r| Some(r.off?.1 / r.yaw_std))
        .collect());
    println!(
        "{what:15} {name:3} {found:4}/{there:4} {wrong:5} {:7.2} {:7.2} {:7.2} {:9.2} {z:6.2} {z_yaw:6.2}",
        at(&mm, 0.5),
        at(&mm, 0.95),
        at(&mm, 1.0),
        at(&turn, 1.0).to_degrees(),
    );
}

/// Words one sighting: how far from the reference, how sure, and what the contour's way came to.
fn row(s: &Sighting, truth: Vector3<f64>) -> String {
    let Some(pose) = s.world_from_object else {
        return format!("not found: {}", s.reason.as_deref().unwrap_or("?"));
    };
    let far = |x: f64, y: f64| 1e3 * (x - truth.x).hypot(y - truth.y);
    let other = match (s.checks.key_point_place, s.checks.refused) {
        (Some([x, y, _]), _) => format!("by key points {:.1} mm", far(x, y)),
        (None, Some(why)) => format!("no key points: {why}"),
        (None, None) => "no key points".to_owned(),
    };
    let at = pose.origin();
    format!(
        "{:.1} mm from the reference, ± {:.1} mm, confidence {:.2}, {:?}; {other}{}",
        far(at.x, at.y),
        1e3 * s.std,
        s.confidence,
        s.way,
        s.ambiguous.as_ref().map(|why| format!("; {why}")).unwrap_or_default(),
    )
}

/// Sees the `ViSP` sequence.
fn visp(out: Option<&Path>) {
    let Some(folder) = absent::public("visp_cube_cylinder") else { return };
    if let Some(out) = out {
        std::fs::create_dir_all(out).unwrap();
        std::fs::write(out.join("visp.task"), SCENE).unwrap();
    }
    // One frame without an output folder, so that the tests can run this example quickly.
    let last = if out.is_some() { 200 } else { 0 };
    for frame in (0..=last).step_by(20) {
        let visp = visp::Visp::read(&folder, Some(frame));
        let image = visp.image(frame);
        let seen = see(&image, &visp.camera, &visp.scene, &Options::default()).unwrap();
        let (cube, axis) = visp.truth(frame);
        for (s, truth) in seen.iter().zip([cube.origin(), axis]) {
            println!("frame {frame:3} {:5} {}", s.name, row(s, truth));
        }
        if let Some(out) = out {
            let calibration = serde_json::json!({ "camera": visp.camera });
            let text = serde_json::to_string_pretty(&calibration).unwrap();
            std::fs::write(out.join(format!("calibration_{frame:04}.json")), text).unwrap();
            annotate(&image, &seen).save(out.join(format!("seen_{frame:04}.png"))).unwrap();
        }
    }
    let visp = visp::Visp::read(&folder, None);
    let (cube, axis) = visp.published();
    let seen = see(&visp.image(0), &visp.camera, &visp.scene, &Options::default()).unwrap();
    for (s, truth) in seen.iter().zip([cube.origin(), axis]) {
        println!("published {:5} {}", s.name, row(s, truth));
    }
    if let Some(out) = out {
        println!("scene and calibrations of {} are in {}", visp.folder.display(), out.display());
    }
}
