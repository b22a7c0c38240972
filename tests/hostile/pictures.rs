//! Pictures that promise more than they hold, and calibrations that calibrate nothing.

use super::{Bench, ENDS, REFUSED};

/// The checksum of PNG: CRC-32 of ISO 3309.
fn checksum(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(u32::MAX, |sum, byte| {
        (0..8).fold(sum ^ u32::from(*byte), |sum, _| (sum >> 1) ^ (0xedb8_8320 * (sum & 1)))
    })
}

fn chunk(kind: &[u8], data: &[u8]) -> Vec<u8> {
    let body = [kind, data].concat();
    [&(data.len() as u32).to_be_bytes()[..], &body, &checksum(&body).to_be_bytes()].concat()
}

/// A PNG whose head promises `width` × `height` pixels, with `more` chunks after it.
fn png(width: u32, height: u32, depth: u8, colour: u8, more: &[u8]) -> Vec<u8> {
    let sizes = [width.to_be_bytes(), height.to_be_bytes()].concat();
    let head = chunk(b"IHDR", &[&sizes[..], &[depth, colour, 0, 0, 0]].concat());
    [b"\x89PNG\r\n\x1a\n", &head[..], more, &chunk(b"IEND", b"")].concat()
}

fn pictures() -> Vec<Vec<u8>> {
    let long = [&u32::MAX.to_be_bytes()[..], b"tEXt", b"x"].concat();
    let jpeg = b"\xff\xd8\xff\xe0\0\x10JFIF\0\x01\x01\0\0\x01\0\x01\0\0\xff\xc0\0\x11\x08\xff\xff\xff\xff\x03\x01\x22\0\x02\x11\x01\x03\x11\x01";
    vec![
        vec![],
        b"\x89PNG".to_vec(),
        png(22_000, 22_000, 8, 2, &chunk(b"IDAT", b"")),
        png(22_000, 22_000, 16, 6, &chunk(b"IDAT", b"x")),
        png(u32::MAX >> 1, u32::MAX >> 1, 8, 2, &[]),
        png(0, 0, 8, 2, &[]),
        png(1280, 720, 8, 2, &[]),
        png(1280, 720, 8, 2, &chunk(b"IDAT", &[0x78, 0x9c, 1, 2, 3])),
        png(1280, 720, 7, 9, &[]),
        png(1280, 720, 8, 3, &chunk(b"IDAT", b"")),
        png(1280, 720, 8, 2, &long),
        jpeg.to_vec(),
        jpeg[..20].to_vec(),
        b"GIF89a\xff\xff\xff\xff".to_vec(),
        b"BM\xff\xff\xff\xff".to_vec(),
        b"\x1b[2Jno picture".to_vec(),
        vec![0xff; 1 << 20],
    ]
}

#[test]
fn pictures_are_looked_at_or_refused() {
    let mut bench = Bench::new("pictures");
    for picture in pictures() {
        bench.case(&[("p.png", &picture)], &["camera", "see", "p.png"], REFUSED);
    }
    bench.case(&[], &["camera", "see", "/dev/zero"], REFUSED);
    bench.case(&[], &["camera", "see", "."], REFUSED);
    bench.end(19);
}

#[test]
fn calibrations_are_read_or_refused() {
    let mut bench = Bench::new("calibrations");
    let mut grey = std::io::Cursor::new(Vec::new());
    image::RgbImage::from_pixel(1280, 720, image::Rgb([120; 3]))
        .write_to(&mut grey, image::ImageFormat::Png)
        .unwrap();
    let grey = grey.into_inner();
    let camera = |intrinsics: &str, pose: &str| {
        format!("{{\"camera\": {{\"intrinsics\": {intrinsics}, \"world_from_camera\": {pose}}}}}")
    };
    let pose = "{\"xyz_m\": [1, 0, 1], \"quat_wxyz\": [1, 0, 0, 0]}";
    let lens = |fx: &str, k1: &str, width: &str| {
        format!(
            "{{\"fx\": {fx}, \"fy\": 900, \"cx\": 640, \"cy\": 360, \"skew\": 0, \"k1\": {k1}, \"k2\": 0, \"width\": {width}, \"height\": 720}}"
        )
    };
    for text in [
        "{}".to_owned(),
        "[".repeat(100_000),
        camera("{}", pose),
        camera(&lens("0", "0", "1280"), pose),
        camera(&lens("-900", "0", "1280"), pose),
        camera(&lens("1e308", "0", "1280"), pose),
        camera(&lens("900", "1e308", "1280"), pose),
        camera(&lens("900", "-50", "1280"), pose),
        camera(&lens("900", "0", "4294967295"), pose),
        camera(&lens("900", "0", "0"), pose),
        camera(
            &lens("900", "0", "1280"),
            "{\"xyz_m\": [1e308, 0, 1], \"quat_wxyz\": [0, 0, 0, 0]}",
        ),
    ] {
        let files: &[(&str, &[u8])] = &[("p.png", &grey), ("c.json", text.as_bytes())];
        bench.case(files, &["camera", "see", "p.png", "--calibration", "c.json"], ENDS);
    }
    bench.end(11);
}
