//! A picture as it is sent: inside the request, no larger than models look at.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use image::codecs::jpeg::JpegEncoder;
use image::codecs::png::PngEncoder;
use image::imageops::{self, FilterType};
use image::{ExtendedColorType, ImageEncoder, RgbImage};
use serde::{Deserialize, Serialize};

/// The longest side that is sent, px: most models scale down to less.
const LONGEST: u32 = 1024;
/// Of 100. Edges of glass against wood survive it.
const QUALITY: u8 = 90;

/// What became of a picture on its way.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Sent {
    /// Width and height as taken, px.
    pub taken_px: [u32; 2],
    /// Width and height as sent, px. All of it is sent, never a part.
    pub sent_px: [u32; 2],
    /// `image/jpeg` or `image/png`.
    pub media: String,
}

/// A picture ready to be sent.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Picture {
    /// `data:image/jpeg;base64,…`
    pub(super) uri: String,
    /// How it was made.
    pub sent: Sent,
}

impl Picture {
    /// A photograph, or a picture of the twin.
    pub fn photo(image: &RgbImage) -> Self {
        let (width, height) = image.dimensions();
        let longest = width.max(height).max(1);
        let small = (longest > LONGEST).then(|| {
            let scaled = |side: u32| (side * LONGEST).div_ceil(longest).max(1);
            imageops::resize(image, scaled(width), scaled(height), FilterType::CatmullRom)
        });
        let sent = small.as_ref().unwrap_or(image);
        let mut bytes = Vec::new();
        JpegEncoder::new_with_quality(&mut bytes, QUALITY)
            .encode_image(sent)
            .expect("an RGB picture in memory can be written as JPEG");
        Self::of("image/jpeg", &bytes, image, sent)
    }

    /// A made picture whose colours are to arrive exactly.
    pub fn exact(image: &RgbImage) -> Self {
        let mut bytes = Vec::new();
        let (width, height) = image.dimensions();
        PngEncoder::new(&mut bytes)
            .write_image(image.as_raw(), width, height, ExtendedColorType::Rgb8)
            .expect("an RGB picture in memory can be written as PNG");
        Self::of("image/png", &bytes, image, image)
    }

    fn of(media: &str, bytes: &[u8], taken: &RgbImage, sent: &RgbImage) -> Self {
        let size = |image: &RgbImage| [image.width(), image.height()];
        Self {
            uri: format!("data:{media};base64,{}", STANDARD.encode(bytes)),
            sent: Sent { taken_px: size(taken), sent_px: size(sent), media: media.to_owned() },
        }
    }
}
