//! Published calibrations beside ours: Zhang's five views, `OpenCV`'s chessboards, the graffiti pair.
//!
//! `cargo run --release --example public_sets [DATA] [--write OUT]`, where `DATA` holds `zhang_planar`,
//! `opencv_chessboard` and `graf_homography` (default `../shared/data/public`). With `--write`, the tables
//! that `trueup align` reads are written to `OUT`.
#![expect(clippy::print_stdout, reason = "an example shows what it does")]

use std::error::Error;
use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};

use trueup::alignment::files::{read_map_pairs, read_views};
use trueup::alignment::image_map::{self, fit_map};
use trueup::alignment::intrinsics::{Distortion, NAMES, Options, calibrate};

fn main() -> Result<(), Box<dyn Error>> {
    let mut data = PathBuf::from("../shared/data/public");
    let mut out = None;
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        if argument == "--write" {
            out = Some(PathBuf::from(arguments.next().ok_or("--write needs a folder")?));
        } else {
            data = PathBuf::from(argument);
        }
    }
    for (set, convert) in [
        ("zhang_planar", zhang as fn(&Path) -> Result<String, Box<dyn Error>>),
        ("opencv_chessboard", chessboard),
        ("graf_homography", graffiti),
    ] {
        let dir = data.join(set);
        if !dir.is_dir() {
            println!("skipped: {set}, {} is not here\n", dir.display());
            continue;
        }
        let table = convert(&dir)?;
        if let Some(out) = &out {
            fs::create_dir_all(out)?;
            fs::write(out.join(format!("{set}.csv")), &table)?;
        }
        println!("{set}");
        match set {
            "graf_homography" => show_map(&table)?,
            "zhang_planar" => show_camera(
                &table,
                Some(true),
                Distortion::K1K2,
                &[
                    832.5, 832.53, 303.959, 206.585, 0.204_494, -0.228_601, 0.190_353, 0.0, 0.0,
                    0.0, 0.0,
                ],
                "published",
                0.335,
            )?,
            _ => show_camera(
                &table,
                Some(false),
                Distortion::K1K2P1P2K3,
                &[
                    532.827, 532.946, 342.487, 233.856, 0.0, -0.280_88, 0.025_18, 0.001_22,
                    -0.000_14, 0.163_44, 0.0,
                ],
                "cv2",
                0.195_42,
            )?,
        }
        println!();
    }
    Ok(())
}

const HEADER: &str = "x[m],y[m],z[m],u[px],v[px],view\n";

fn numbers(text: &str) -> Vec<f64> {
    text.split_whitespace().filter_map(|word| word.parse().ok()).collect()
}

/// Four corners of 64 squares in inches, and the same corners in five pictures.
fn zhang(dir: &Path) -> Result<String, Box<dyn Error>> {
    let model = numbers(&fs::read_to_string(dir.join("Model.txt"))?);
    let mut table = HEADER.replace("[m]", "[in]");
    for view in 1..=5 {
        let pixels = numbers(&fs::read_to_string(dir.join(format!("data{view}.txt")))?);
        for (m, p) in model.chunks_exact(2).zip(pixels.chunks_exact(2)) {
            writeln!(table, "{},{},0,{},{},data{view}", m[0], m[1], p[0], p[1])?;
        }
    }
    Ok(table)
}

/// Corners of a board of 25 mm squares: image, corner, row, column, u, v.
fn chessboard(dir: &Path) -> Result<String, Box<dyn Error>> {
    let mut table = HEADER.replace("[m]", "[mm]");
    for line in fs::read_to_string(dir.join("corners_left_cv2.csv"))?.lines().skip(1) {
        let cells: Vec<&str> = line.split(',').collect();
        let [view, _, row, column, u, v] = cells[..] else {
            return Err(format!("not six cells: {line}").into());
        };
        let (row, column): (f64, f64) = (row.parse()?, column.parse()?);
        writeln!(table, "{},{},0,{u},{v},{view}", 25.0 * column, 25.0 * row)?;
    }
    Ok(table)
}

/// Matches between the first and the third picture of the graffiti wall.
fn graffiti(dir: &Path) -> Result<String, Box<dyn Error>> {
    let mut table = String::from("v_x[px],v_y[px],u_x[px],u_y[px]\n");
    for line in fs::read_to_string(dir.join("matches_sift.csv"))?.lines().skip(1) {
        let cells: Vec<&str> = line.split(',').take(4).collect();
        writeln!(table, "{}", cells.join(","))?;
    }
    Ok(table)
}

fn show_camera(
    table: &str,
    skew: Option<bool>,
    distortion: Distortion,
    published: &[f64; NAMES.len()],
    whose: &str,
    rms: f64,
) -> Result<(), Box<dyn Error>> {
    let fit =
        calibrate(&read_views(table, None)?, &Options { skew, distortion, ..Options::default() })?;
    let k = fit.intrinsics;
    let ours = [k.fx, k.fy, k.cx, k.cy, k.skew, k.k1, k.k2, k.p1, k.p2, k.k3, k.k4];
    println!("{:>10} {:>12} {:>12} {:>10}", "", whose, "ours", "±");
    for (i, name) in NAMES.iter().enumerate() {
        println!("{name:>10} {:>12.5} {:>12.5} {:>10.5}", published[i], ours[i], fit.std[i]);
    }
    println!("{:>10} {rms:>12.5} {:>12.5}", "rms [px]", fit.rms_px);
    Ok(())
}

fn show_map(table: &str) -> Result<(), Box<dyn Error>> {
    let pairs = read_map_pairs(table)?;
    let fit = fit_map(&pairs, image_map::Model::Auto, &image_map::Options::default())?;
    println!("{}: {}", fit.model.name(), fit.reason);
    println!("M = {:.7}", fit.m);
    println!(
        "rms {:.3} px over {} of {} matches",
        fit.rms_px,
        pairs.len() - fit.outliers.len(),
        pairs.len()
    );
    for c in &fit.compared {
        println!("{:>11}: rms {:.3} px", c.model.name(), c.mse_px.sqrt());
    }
    Ok(())
}
