//! A picture's bytes → pixels. The header is read first: a file of kilobytes may stand for gigabytes of pixels.

use std::io::{self, Cursor};
use std::path::Path;

use image::{ImageError, ImageReader, Limits, RgbImage, imageops};

use crate::files;

/// Pixels of a picture that are read; eight times what a camera of a laboratory has.
const MOST_PIXELS: u64 = 64_000_000;
/// Bytes a decoder may take: as many pixels of the widest kind, and as much again for its texts and tables.
const MOST_BYTES: u64 = 600 << 20;
/// Bytes of a picture's file.
const LARGEST: u64 = 256 << 20;

/// Why there are no pixels.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The file cannot be read.
    #[error("{0}")]
    File(#[from] io::Error),
    /// More pixels than are read.
    #[error("it has {width} x {height} pixels, and at most 64 million are read")]
    TooLarge {
        /// Its width, px.
        width: u32,
        /// Its height, px.
        height: u32,
    },
    /// The bytes are no picture.
    #[error("{0}")]
    Picture(#[from] ImageError),
}

/// Reads a PNG or JPEG file.
///
/// # Errors
///
/// [`Error`].
pub fn read(path: &Path) -> Result<RgbImage, Error> {
    decoded(&files::read::bytes(path, LARGEST)?)
}

/// Returns a picture made small, `width` px wide and as high as its shape asks for; nothing of a picture without pixels.
pub fn small(image: &RgbImage, width: u32) -> Option<RgbImage> {
    let from = u64::from(image.width());
    let height = (u64::from(image.height()) * u64::from(width)).checked_div(from)?.max(1);
    Some(imageops::thumbnail(image, width, height as u32))
}

/// Reads the bytes of a PNG or JPEG file.
///
/// # Errors
///
/// [`Error`].
pub fn decoded(bytes: &[u8]) -> Result<RgbImage, Error> {
    let reader = || -> Result<_, Error> {
        let mut reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format()?;
        let mut limits = Limits::default();
        limits.max_alloc = Some(MOST_BYTES);
        reader.limits(limits);
        Ok(reader)
    };
    let (width, height) = reader()?.into_dimensions()?;
    if u64::from(width) * u64::from(height) > MOST_PIXELS {
        return Err(Error::TooLarge { width, height });
    }
    Ok(reader()?.decode()?.into_rgb8())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The signature and header of a PNG file of a size, with the check sums the format wants.
    fn header(width: u32, height: u32) -> Vec<u8> {
        let mut chunk = b"IHDR".to_vec();
        chunk.extend(width.to_be_bytes());
        chunk.extend(height.to_be_bytes());
        chunk.extend([8, 2, 0, 0, 0]);
        let mut file = b"\x89PNG\r\n\x1a\n\0\0\0\x0d".to_vec();
        let mut crc = !0_u32;
        for byte in &chunk {
            crc ^= u32::from(*byte);
            for _ in 0..8 {
                crc = (crc >> 1) ^ (0xedb8_8320 & (crc & 1).wrapping_neg());
            }
        }
        file.extend(&chunk);
        file.extend((!crc).to_be_bytes());
        // An empty piece of pixels, so that a decoder gets past the header.
        file.extend(b"\0\0\0\0IDAT\x35\xaf\x06\x1e");
        file
    }

    #[test]
    fn a_picture_of_gigabytes_is_refused_by_its_header() {
        let error = decoded(&header(22_000, 22_000)).unwrap_err();
        assert!(matches!(error, Error::TooLarge { width: 22_000, height: 22_000 }), "{error}");
        let error = decoded(&header(8, 6)).unwrap_err();
        assert!(matches!(error, Error::Picture(_)), "{error}");
    }

    #[test]
    fn a_picture_comes_back_and_text_is_none() {
        let picture = RgbImage::from_pixel(3, 2, image::Rgb([1, 2, 3]));
        let mut png = Cursor::new(Vec::new());
        picture.write_to(&mut png, image::ImageFormat::Png).unwrap();
        assert_eq!(decoded(png.get_ref()).unwrap(), picture);
        assert!(matches!(decoded(b"no picture").unwrap_err(), Error::Picture(_)));
        assert!(matches!(read(Path::new("gone.png")).unwrap_err(), Error::File(_)));
    }
}
