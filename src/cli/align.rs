//! `trueup align`: the three regressions on files, and a camera on a wrist or beside an arm.

mod hand_eye;

use std::path::{Path, PathBuf};

use clap::{Args, Subcommand};

use crate::alignment::intrinsics::{self, Distortion, calibrate, lens};
use crate::alignment::{files, image_map, offset};
use crate::report::{Failure, Style};

use super::answer::align::{IntrinsicsAnswer, MapAnswer, OffsetAnswer};
use super::inputs::read;
use crate::report::exit::Exit;

#[derive(Debug, Subcommand)]
pub(super) enum AlignCommand {
    /// Regression 1: the map from twin pixels to real ones, `u = M v`.
    Map {
        /// Pairs: `u_x[px],u_y[px],v_x[px],v_y[px]`, real pixel and twin pixel.
        file: PathBuf,
        /// Which map: `auto` lets the evidence choose.
        #[arg(long, default_value = "projective", value_parser = ["scale", "affine", "projective", "auto"])]
        model: String,
    },
    /// Regression 2: the camera's intrinsics from points and their pixels.
    Intrinsics(IntrinsicsArgs),
    /// Regression 3: the matrix D of `p_s = D p_r`.
    Offset {
        /// Pairs: `xs[m],ys[m],zs[m],xr[m],yr[m],zr[m]`, where the twin said and where it should be.
        file: PathBuf,
        /// Which form: `auto` lets the evidence choose.
        #[arg(
            long,
            default_value = "auto",
            value_parser = ["translation", "rigid", "similarity", "affine", "full", "auto"]
        )]
        model: String,
    },
    /// Where a camera sits on the wrist or beside the arm, from pictures of a chessboard and the arm's poses.
    HandEye(hand_eye::HandEyeArgs),
}

#[derive(Debug, Args)]
pub(super) struct IntrinsicsArgs {
    /// Points: `x[m],y[m],z[m],u[px],v[px],view`; where the views were seen from may stand in
    /// `POINTS.extrinsics.json` beside it. A planar target (z = 0) needs no extrinsics.
    file: PathBuf,
    /// Which terms of the lens are fitted; `auto` keeps those that the views pay for.
    #[arg(
        long,
        default_value = "k1k2",
        value_parser = ["none", "k1", "k1k2", "k1k2k3", "k1p1p2", "k1k2p1p2", "k1k2p1p2k3", "auto"]
    )]
    distortion: String,
    /// Size of the pictures, px: `1280x720`; needed for a single planar view only.
    #[arg(long, value_parser = size)]
    image: Option<(u32, u32)>,
}

fn size(text: &str) -> Result<(u32, u32), String> {
    let (w, h) = text.split_once('x').ok_or("write it as 1280x720")?;
    match (w.trim().parse(), h.trim().parse()) {
        (Ok(w), Ok(h)) => Ok((w, h)),
        _ => Err("write it as 1280x720".into()),
    }
}

/// `trueup align ...`.
pub(super) fn align(
    command: &AlignCommand,
    scene: Option<&PathBuf>,
    style: Style,
) -> Result<Exit, Failure> {
    match command {
        AlignCommand::HandEye(args) => return hand_eye::hand_eye(args, scene, style),
        AlignCommand::Map { file, model } => {
            let pairs = files::read_map_pairs(&read(file)?).map_err(|e| table(&e, file))?;
            let model = image_map::Model::from_name(model).unwrap_or(image_map::Model::Projective);
            let fit = image_map::fit_map(&pairs, model, &image_map::Options::default())
                .map_err(|error| degenerate(&error, file))?;
            style.answer(&MapAnswer::from(&fit));
        }
        AlignCommand::Intrinsics(args) => {
            let file = &args.file;
            let beside = file.with_extension("extrinsics.json");
            let extrinsics = if beside.exists() { Some(read(&beside)?) } else { None };
            let views = files::read_views(&read(file)?, extrinsics.as_deref())
                .map_err(|e| table(&e, file))?;
            let options =
                intrinsics::Options { image_size: args.image, ..intrinsics::Options::default() };
            let fit = match Distortion::from_name(&args.distortion) {
                Some(distortion) => {
                    calibrate(&views, &intrinsics::Options { distortion, ..options })
                }
                None => lens::choose(&views, &options).map(|(fit, _)| fit),
            };
            let fit = fit.map_err(|error| degenerate(&error, file))?;
            style.answer(&IntrinsicsAnswer::from(&fit));
        }
        AlignCommand::Offset { file, model } => {
            let pairs = files::read_offset_pairs(&read(file)?).map_err(|e| table(&e, file))?;
            let model = offset::Model::from_name(model).unwrap_or(offset::Model::Auto);
            let fit = offset::fit_offset(&pairs, model, &offset::Options::default())
                .map_err(|error| degenerate(&error, file))?;
            style.answer(&OffsetAnswer::from(&fit));
        }
    }
    Ok(Exit::Yes)
}

fn table(error: &files::Error, file: &Path) -> Failure {
    Failure::input("align::table", error.to_string()).at(file.display().to_string())
}

fn degenerate(error: &crate::alignment::Error, file: &Path) -> Failure {
    Failure::input("align::degenerate", error.to_string()).at(file.display().to_string())
}
