//! `trueup camera segment`: a thing cut out of a picture, without a scene and without a pose.

use std::path::{Path, PathBuf};

use clap::Args;
use image::{GrayImage, RgbImage};

use crate::alignment::overlay;
use crate::alignment::picture::Picture;
use crate::alignment::segment::{
    By, LEAST_SIDE, Prompt, Segment, best, everything, extent, offered, segment,
};
use crate::files::write;
use crate::masks::Where;
use crate::report::exit::Exit;
use crate::report::{self, Failure, Style};

use super::super::answer::segment::{Answer, Others};
use super::masks::{self, Asked, MasksArgs};
use super::{picture, unwritten};

#[derive(Debug, Args)]
pub(in crate::cli) struct SegmentArgs {
    /// The picture (PNG or JPEG). With nothing more said, everything that stands out is cut out.
    image: PathBuf,
    /// A box around the thing, with some room: left, top, right, bottom in pixels.
    #[arg(long = "box", value_name = "X0,Y0,X1,Y1", value_parser = numbers::<4>, group = "prompt")]
    bounds: Option<[f64; 4]>,
    /// A place on the thing, in pixels.
    #[arg(long, value_name = "X,Y", value_parser = numbers::<2>, group = "prompt")]
    point: Option<[f64; 2]>,
    /// A rough mask of it: a picture of the same size, not black where the thing is.
    #[arg(long, value_name = "FILE", group = "prompt")]
    mask: Option<PathBuf>,
    /// Where the masks and a copy of the picture with their outlines go.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    #[command(flatten)]
    masks: MasksArgs,
}

/// Reads `N` numbers with commas between them.
fn numbers<const N: usize>(text: &str) -> Result<[f64; N], String> {
    let each: Result<Vec<f64>, _> = text.split(',').map(|part| part.trim().parse()).collect();
    let wrong = || format!("write {N} numbers of pixels with commas between them");
    let all: [f64; N] = each.map_err(|_| wrong())?.try_into().map_err(|_| wrong())?;
    if all.iter().all(|number| number.is_finite()) { Ok(all) } else { Err(wrong()) }
}

/// `trueup camera segment ...`.
pub(super) fn segment_picture(args: &SegmentArgs, style: Style) -> Result<Exit, Failure> {
    let image = picture(&args.image)?;
    let asked = prompt(args, &image)?;
    let others = masks::opened(&args.masks, style)?;
    let seen = Picture::new(&image);
    let theirs = match &others {
        Some(others) => theirs(others, &image, &seen, asked.as_ref())?,
        None => Vec::new(),
    };
    let mut cuts: Vec<Segment> = match &asked {
        Some(asked) => segment(&seen, asked).into_iter().collect(),
        None => everything(&seen),
    };
    let said = others.map(|others| Others::new(&others.name, &cuts, &theirs));
    if !theirs.is_empty() {
        cuts.extend(theirs);
        cuts = best(cuts, asked.is_some());
    }
    let masks = match &args.out {
        Some(dir) => keep(dir, &image, &cuts)?,
        None => Vec::new(),
    };
    if style.json {
        style.document(&Answer::new(&cuts, &masks, image.dimensions(), said));
    } else {
        style.say(report::segments(&cuts, &masks, asked.is_some()));
        if let Some(said) = &said {
            let is_theirs = cuts.iter().any(|cut| cut.by != By::Ours);
            style.say(report::others_masks(&said.from, said.came, said.agreement, is_theirs));
        }
    }
    Ok(if cuts.is_empty() { Exit::No } else { Exit::Yes })
}

/// What somebody else cuts out there, judged as our own cuts are. A rough mask is sent as its box.
fn theirs(
    others: &Asked,
    image: &RgbImage,
    seen: &Picture,
    asked: Option<&Prompt>,
) -> Result<Vec<Segment>, Failure> {
    let places: Vec<Where> = match asked {
        None => Vec::new(),
        Some(Prompt::Box(bounds)) => vec![Where::Box(*bounds)],
        Some(Prompt::Point(at)) => vec![Where::Point(*at)],
        Some(Prompt::Mask(mask)) => {
            extent(mask).map(|(held, _)| Where::Box(held)).into_iter().collect()
        }
    };
    let came = others.ask(image, &places)?;
    Ok(came.iter().filter_map(|one| offered(seen, &one.mask, one.score, asked)).collect())
}

/// Writes the masks and the picture with their outlines; returns where the masks are.
fn keep(dir: &Path, image: &RgbImage, cuts: &[Segment]) -> Result<Vec<String>, Failure> {
    std::fs::create_dir_all(dir).map_err(unwritten(dir))?;
    let mut masks = Vec::new();
    for (k, cut) in cuts.iter().enumerate() {
        let path = dir.join(format!("mask-{}.png", k + 1));
        write::picture(&path, &cut.mask).map_err(unwritten(&path))?;
        masks.push(path.display().to_string());
    }
    let mut drawn = image.clone();
    for (k, cut) in cuts.iter().enumerate() {
        overlay::outline(&mut drawn, &cut.contour, k);
    }
    let path = dir.join("segmented.png");
    write::picture(&path, &drawn).map_err(unwritten(&path))?;
    Ok(masks)
}

/// What was said of where the thing is, if it can be so.
fn prompt(args: &SegmentArgs, image: &RgbImage) -> Result<Option<Prompt>, Failure> {
    let (w, h) = (f64::from(image.width()), f64::from(image.height()));
    if let Some([u0, v0, u1, v1]) = args.bounds {
        let within = [u0.max(0.0), v0.max(0.0), u1.min(w - 1.0), v1.min(h - 1.0)];
        if within[2] - within[0] < LEAST_SIDE || within[3] - within[1] < LEAST_SIDE {
            return Err(beside(
                "the box",
                image,
                "left, top, right, bottom; the box must be 8 px or more each way",
            ));
        }
        return Ok(Some(Prompt::Box(within)));
    }
    if let Some([u, v]) = args.point {
        if u < 0.0 || v < 0.0 || u > w - 1.0 || v > h - 1.0 {
            return Err(beside(
                "the point",
                image,
                "x from the left and y from the top, in pixels",
            ));
        }
        return Ok(Some(Prompt::Point([u, v])));
    }
    args.mask.as_deref().map(|path| rough(path, image).map(Prompt::Mask)).transpose()
}

fn beside(what: &str, image: &RgbImage, help: &str) -> Failure {
    let (w, h) = image.dimensions();
    Failure::input("camera::prompt", format!("{what} is not in the picture of {w} x {h} px"))
        .help(help)
}

/// Reads a rough mask.
fn rough(path: &Path, image: &RgbImage) -> Result<GrayImage, Failure> {
    let mask = image::DynamicImage::ImageRgb8(picture(path)?).to_luma8();
    let place = path.display().to_string();
    let (w, h) = mask.dimensions();
    if (w, h) != image.dimensions() {
        let (iw, ih) = image.dimensions();
        let message = format!("the mask has {w} x {h} px, the picture {iw} x {ih} px");
        return Err(Failure::input("camera::prompt", message)
            .at(place)
            .help("a mask has the picture's size, and is not black where the thing is"));
    }
    if mask.pixels().all(|pixel| pixel.0[0] == 0) {
        return Err(Failure::input("camera::prompt", "the mask is black everywhere")
            .at(place)
            .help("a mask is not black where the thing is"));
    }
    Ok(mask)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_as_many_as_asked_for() {
        assert_eq!(numbers::<2>("3, 4.5"), Ok([3.0, 4.5]));
        for wrong in ["", "3", "3,4,5", "3,x", "3,nan", "3;4"] {
            assert!(numbers::<2>(wrong).is_err(), "{wrong}");
        }
    }
}
