//! The strict reading of what a server of masks sends: `{"masks": [{"prompt": 0, "score": 0.9, "rle": {..} or "png": ".."}]}`.

use std::io::Cursor;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use image::{GrayImage, ImageFormat, ImageReader, Limits, Luma};
use serde_json::Value;

use super::endpoint::begins;
use super::{Flaw, Mask, rle};

/// Masks that are read. Chosen: segment-anything finds some hundred in a crowded picture.
const MOST: usize = 256;

/// What is wrong, with the number of the mask from 1 if it is one.
type Wrong = (Option<usize>, Flaw);

/// Reads an answer; `size` is the picture's, `places` how many were asked about.
pub(super) fn read(body: &[u8], size: (u32, u32), places: usize) -> Result<Vec<Mask>, Wrong> {
    let document: Value = serde_json::from_slice(body).map_err(|_| (None, no_json(body)))?;
    let list = document["masks"].as_array().ok_or((None, Flaw::NoList))?;
    if list.len() > MOST {
        return Err((None, Flaw::TooMany(list.len(), MOST)));
    }
    let read =
        |(k, entry): (usize, &Value)| mask(entry, size, places).map_err(|flaw| (Some(k + 1), flaw));
    list.iter().enumerate().map(read).collect()
}

/// Why a text is no JSON. Python writes numbers that JSON does not have.
fn no_json(body: &[u8]) -> Flaw {
    let text = String::from_utf8_lossy(body);
    let is_document = text.trim_start().starts_with('{');
    let has = |word: &str| text.split(|c: char| !c.is_alphanumeric()).any(|part| part == word);
    if is_document && (has("NaN") || has("Infinity")) {
        return Flaw::NoNumber;
    }
    Flaw::NotJson(begins(body))
}

fn mask(entry: &Value, size: (u32, u32), places: usize) -> Result<Mask, Flaw> {
    let of = match &entry["prompt"] {
        Value::Null if places > 1 => return Err(Flaw::WhichPrompt(places)),
        Value::Null => (places == 1).then_some(0),
        // Nothing was asked about, so nothing is answered.
        _ if places == 0 => None,
        said => {
            let number = said.as_u64().filter(|number| *number < places as u64);
            Some(number.ok_or(Flaw::Prompt(places))? as usize)
        }
    };
    let score = entry["score"].as_f64().filter(|score| score.is_finite()).ok_or(Flaw::Score)?;
    let mask = match (&entry["rle"], &entry["png"]) {
        (Value::Null, Value::Null) => return Err(Flaw::Neither),
        (Value::Null, png) => picture(png.as_str().unwrap_or_default(), size)?,
        (runs, _) => rle::mask(runs, size)?,
    };
    Ok(Mask { of, mask, score })
}

/// A mask as a picture: what is not black is the thing.
fn picture(base64: &str, size: (u32, u32)) -> Result<GrayImage, Flaw> {
    let png = |why: &dyn ToString| Flaw::Png(why.to_string());
    // A data URI is as good.
    let data = base64.strip_prefix("data:image/png;base64,").unwrap_or(base64);
    let bytes = STANDARD.decode(data).map_err(|why| png(&why))?;
    let reader = || ImageReader::with_format(Cursor::new(&bytes[..]), ImageFormat::Png);
    // The header is read first: kilobytes may stand for gigabytes.
    let (width, height) = reader().into_dimensions().map_err(|why| png(&why))?;
    if (width, height) != size {
        return Err(Flaw::Size { got: (width.into(), height.into()), asked: size });
    }
    let mut reader = reader();
    let mut limits = Limits::default();
    // The widest kind of pixel has eight bytes; as much again for the decoder.
    limits.max_alloc = Some(16 * u64::from(width) * u64::from(height) + (1 << 20));
    reader.limits(limits);
    let mut mask = reader.decode().map_err(|why| png(&why))?.to_luma8();
    for pixel in mask.pixels_mut() {
        *pixel = Luma([if pixel.0[0] > 0 { 255 } else { 0 }]);
    }
    Ok(mask)
}
