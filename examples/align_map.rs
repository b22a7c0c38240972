//! Regression 1 in one page: pairs of pixels in, the map and what is known about it out.
//!
//! `cargo run --example align_map [PAIRS.csv]`; without a file, a table seen by two cameras.
#![expect(clippy::print_stdout, reason = "an example shows what it does")]

use std::error::Error;

use trueup::alignment::files::read_map_pairs;
use trueup::alignment::image_map::{Model, Options, fit_map};

/// Nine reference points of a table; the seventh row was matched wrongly.
const TABLE: &str = "u_x[px],u_y[px],v_x[px],v_y[px]
212.4,540.9,220,520
640.2,548.6,640,520
1068.3,556.2,1060,520
301.7,371.5,310,350
641.5,375.2,640,350
982.0,379.4,970,350
420.0,300.0,362,250
642.1,273.6,640,250
932.8,276.1,918,250
";

fn main() -> Result<(), Box<dyn Error>> {
    let text = match std::env::args().nth(1) {
        Some(path) => std::fs::read_to_string(path)?,
        None => TABLE.to_string(),
    };
    let fit = fit_map(&read_map_pairs(&text)?, Model::Auto, &Options::default())?;
    println!("{}: {}", fit.model.name(), fit.reason);
    println!("M = {:.6}", fit.m);
    println!("rms {:.3} px, rows left out: {:?}", fit.rms_px, fit.outliers);
    if let (Some(left_out), Some((row, error))) = (fit.leave_one_out_px, fit.worst) {
        println!("left out and predicted: {left_out:.3} px, worst row {row} by {error:.3} px");
    }
    for c in &fit.compared {
        let rms = c.mse_px.sqrt();
        println!(
            "{:>11} ({} dof): rms {rms:.3} px, evidence {:.1}",
            c.model.name(),
            c.model.dof(),
            c.evidence
        );
    }
    Ok(())
}
