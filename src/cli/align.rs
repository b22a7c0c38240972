//! `trueup align`: the three regressions on files, and a camera on a wrist or beside an arm.

mod hand_eye;

use std::path::{Path, PathBuf};

use clap::{Args, Subcommand};
use nalgebra::Vector2;

use crate::alignment::intrinsics::strays::{self, Without};
use crate::alignment::intrinsics::{self, Distortion, calibrate, lens};
use crate::alignment::{files, image_map, offset};
use crate::report::{Failure, Style, aligned};

use super::answer::align::{IntrinsicsAnswer, KnownAnswer, MapAnswer, OffsetAnswer};
use super::clock::clock;
use super::inputs::read;
use crate::report::exit::Exit;

#[derive(Debug, Subcommand)]
pub(super) enum AlignCommand {
    /// Regression 1: the map from twin pixels to real ones, `u = M v`.
    Map(MapArgs),
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
        /// Where to say how far the offset is known, m: `0.4,0.1,0.2`; may be given several times.
        #[arg(long, value_name = "X,Y,Z", value_parser = point, allow_hyphen_values = true)]
        at: Vec<[f64; 3]>,
    },
    /// Where a camera sits on the wrist or beside the arm, from pictures of a board and the arm's poses.
    HandEye(hand_eye::HandEyeArgs),
}

#[derive(Debug, Args)]
pub(super) struct MapArgs {
    /// Pairs: `u_x[px],u_y[px],v_x[px],v_y[px]`, real pixel and twin pixel; a column `score` says which are likelier right.
    file: PathBuf,
    /// Which map: `auto` lets the evidence choose.
    #[arg(long, default_value = "projective", value_parser = ["scale", "affine", "projective", "auto"])]
    model: String,
    /// Size of the twin's picture, px: `1280x720`; as far as the points reach when left out.
    #[arg(long, value_parser = size)]
    image: Option<(u32, u32)>,
    /// Fit the form that was asked for and no other.
    #[arg(long)]
    no_compare: bool,
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
        value_parser = [
            "none", "k1", "k1k2", "k1k2k3", "k1p1p2", "k1k2p1p2", "k1k2p1p2k3", "fisheye-none", "fisheye-k1",
            "fisheye-k1k2", "fisheye-k1k2k3", "fisheye", "auto"
        ]
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

fn point(text: &str) -> Result<[f64; 3], String> {
    let numbers = text.split(',').map(|word| word.trim().parse::<f64>());
    let numbers: Vec<f64> = numbers.flatten().filter(|x| x.is_finite()).collect();
    <[f64; 3]>::try_from(numbers).map_err(|_| "write it as 0.4,0.1,0.2".into())
}

/// `trueup align map`.
fn map(args: &MapArgs, style: Style) -> Result<Exit, Failure> {
    let file = &args.file;
    let (pairs, scores) = files::read_ranked_pairs(&read(file)?).map_err(|e| table(&e, file))?;
    let model = image_map::Model::from_name(&args.model).unwrap_or(image_map::Model::Projective);
    let options = image_map::Options::default();
    let begin = clock();
    let fit = image_map::fit_map_ranked(&pairs, scores.as_deref(), model, &options)
        .map_err(|error| degenerate(&error, file))?;
    let time_us = Some(1e6 * (clock() - begin));
    let size = match args.image {
        Some((width, height)) => Vector2::new(f64::from(width), f64::from(height)),
        None => image_map::reached(&pairs),
    };
    let (grid, warnings) = (fit.uncertainty(size), fit.warnings(&pairs, size));
    let compared = if !args.no_compare && fit.compared.len() < 2 {
        image_map::compare(&pairs, &fit, &options)
    } else {
        fit.compared.clone()
    };
    if style.json {
        let answer = MapAnswer::from(&fit).trusted(grid, &warnings).beside(&compared);
        style.document(&MapAnswer { time_us, ..answer });
    } else {
        style.say(aligned::map(&fit, &compared, grid.as_ref(), &warnings).trim_end());
    }
    Ok(Exit::Yes)
}

/// `trueup align ...`.
pub(super) fn align(
    command: &AlignCommand,
    scene: Option<&PathBuf>,
    style: Style,
) -> Result<Exit, Failure> {
    match command {
        AlignCommand::HandEye(args) => return hand_eye::hand_eye(args, scene, style),
        AlignCommand::Map(args) => return map(args, style),
        AlignCommand::Intrinsics(args) => {
            let file = &args.file;
            let beside = file.with_extension("extrinsics.json");
            let extrinsics = if beside.exists() { Some(read(&beside)?) } else { None };
            let views = files::read_views(&read(file)?, extrinsics.as_deref())
                .map_err(|e| table(&e, file))?;
            let options =
                intrinsics::Options { image_size: args.image, ..intrinsics::Options::default() };
            let distortion = Distortion::from_name(&args.distortion);
            let found = strays::without(&views, |views| match distortion {
                Some(distortion) => {
                    let options = intrinsics::Options { distortion, ..options };
                    calibrate(views, &options).map(|fit| (fit, ()))
                }
                None => lens::choose(views, &options).map(|(fit, _)| (fit, ())),
            });
            let Without { fit: (fit, ()), strays, .. } =
                found.map_err(|error| degenerate(&error, file))?;
            if style.json {
                style.document(&IntrinsicsAnswer::from(&fit).without(&strays));
            } else {
                style.say(aligned::intrinsics(&fit, &strays).trim_end());
            }
        }
        AlignCommand::Offset { file, model, at } => {
            let pairs = files::read_offset_pairs(&read(file)?).map_err(|e| table(&e, file))?;
            let model = offset::Model::from_name(model).unwrap_or(offset::Model::Auto);
            let fit = offset::fit_offset(&pairs, model, &offset::Options::default())
                .map_err(|error| degenerate(&error, file))?;
            let asked: Vec<offset::Known> =
                at.iter().filter_map(|&at| fit.known_at(at.into())).collect();
            if style.json {
                let mut answer = OffsetAnswer::from(&fit);
                answer.known.extend(asked.iter().map(KnownAnswer::from));
                style.document(&answer);
            } else {
                style.say(aligned::offset(&fit, pairs.len(), &asked).trim_end());
            }
        }
    }
    Ok(Exit::Yes)
}

fn table(error: &files::Error, file: &Path) -> Failure {
    Failure::input("align::table", error.to_string())
        .at(file.display().to_string())
        .help("the columns of each table: `trueup align map --help`, `… intrinsics --help`, `… offset --help`")
}

fn degenerate(error: &crate::alignment::Error, file: &Path) -> Failure {
    Failure::input("align::degenerate", error.to_string())
        .at(file.display().to_string())
        .help(error.help())
}
