//! Masks as COCO writes them: lengths of runs, down the columns, beginning with what is not the thing.
//!
//! `counts` is a list of numbers, or the text that `pycocotools` makes of it: differences to the number two before, five bits a
//! character from `0` on, the sixth for "more follows".
//!
//! Source: `rleFrString` in the COCO API's `common/maskApi.c`.

use image::{GrayImage, Luma};
use serde_json::Value;

use super::Flaw;

/// Reads a mask of a picture of this width and height.
pub(super) fn mask(runs: &Value, (width, height): (u32, u32)) -> Result<GrayImage, Flaw> {
    let [high, wide] = &runs["size"].as_array().map_or(&[][..], Vec::as_slice) else {
        return Err(Flaw::Runs);
    };
    let (Some(high), Some(wide)) = (high.as_u64(), wide.as_u64()) else { return Err(Flaw::Runs) };
    if (wide, high) != (width.into(), height.into()) {
        return Err(Flaw::Size { got: (wide, high), asked: (width, height) });
    }
    let counts = match &runs["counts"] {
        Value::Array(list) => list.iter().map(Value::as_u64).collect(),
        Value::String(text) => unpacked(text),
        _ => None,
    };
    let counts: Vec<u64> = counts.ok_or(Flaw::Runs)?;
    let pixels = u64::from(width) * u64::from(height);
    let all = counts.iter().fold(0_u64, |sum, run| sum.saturating_add(*run));
    if all != pixels {
        return Err(Flaw::Length(all, pixels));
    }
    let mut mask = GrayImage::new(width, height);
    let mut at = 0;
    for (k, run) in counts.iter().enumerate() {
        if k % 2 == 1 {
            for i in at..at + run {
                mask.put_pixel((i / high) as u32, (i % high) as u32, Luma([255]));
            }
        }
        at += run;
    }
    Ok(mask)
}

/// The lengths that a text stands for; `None` if it is none.
fn unpacked(text: &str) -> Option<Vec<u64>> {
    let mut counts: Vec<i64> = Vec::new();
    let (mut number, mut shift) = (0_i64, 0);
    for byte in text.bytes() {
        let bits = i64::from(byte.checked_sub(48).filter(|bits| *bits < 64)?);
        number |= (bits & 0x1f) << shift;
        shift += 5;
        // No length has as many bits as this.
        if shift > 50 {
            return None;
        }
        if bits & 0x20 == 0 {
            if bits & 0x10 != 0 {
                number |= -1 << shift;
            }
            if counts.len() > 2 {
                number += counts[counts.len() - 2];
            }
            counts.push(number);
            (number, shift) = (0, 0);
        }
    }
    let all = counts.into_iter().map(|count| u64::try_from(count).ok());
    if shift == 0 { all.collect() } else { None }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    /// By `pycocotools` 2.0: `mask.encode` of a mask of 5 x 4 px (wide, high) with a block of 2 x 2 at (1, 1).
    #[test]
    fn runs_are_read_in_both_forms() {
        let is_in = |x: u32, y: u32| (1..3).contains(&x) && (1..3).contains(&y);
        for counts in [json!([5, 2, 2, 2, 9]), json!("52207")] {
            let mask = mask(&json!({"size": [4, 5], "counts": counts}), (5, 4)).unwrap();
            for (x, y, pixel) in mask.enumerate_pixels() {
                assert_eq!(pixel.0[0] > 0, is_in(x, y), "{counts} {x} {y}");
            }
        }
    }

    /// By `pycocotools` 2.0: a disc of `OpenCV`, 13 px in radius, in a picture of 60 x 40 px.
    #[test]
    fn longer_runs_and_negative_differences_are_read() {
        let counts = "le01R1:J2M4M2N2O0O2N2O0000000O20N100000001N2N101N2N3L3N6Fac0";
        let mask = mask(&json!({"size": [40, 60], "counts": counts}), (60, 40)).unwrap();
        assert_eq!(mask.pixels().filter(|pixel| pixel.0[0] > 0).count(), 529);
        for (x, y, pixel) in mask.enumerate_pixels() {
            let far = (f64::from(x) - 30.0).hypot(f64::from(y) - 20.0);
            assert!((far - 13.0).abs() < 1.0 || (pixel.0[0] > 0) == (far < 13.0), "{x} {y}");
        }
    }

    #[test]
    fn what_is_no_run_is_said() {
        let read = |runs: Value| mask(&runs, (5, 4)).unwrap_err();
        assert_eq!(
            read(json!({"size": [5, 4], "counts": []})),
            Flaw::Size { got: (4, 5), asked: (5, 4) }
        );
        assert_eq!(read(json!({"size": [4, 5], "counts": [5, 2]})), Flaw::Length(7, 20));
        assert_eq!(read(json!({"size": [4, 5], "counts": [25, -5]})), Flaw::Runs);
        assert_eq!(read(json!({"size": [4, 5], "counts": "5 2"})), Flaw::Runs);
        assert_eq!(
            read(json!({"size": [4, 5], "counts": [u64::MAX, 2]})),
            Flaw::Length(u64::MAX, 20)
        );
        assert_eq!(read(json!({"size": [4, 5]})), Flaw::Runs);
        assert_eq!(read(json!([1, 2])), Flaw::Runs);
    }
}
