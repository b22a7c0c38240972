//! Coded pictures → an MP4 file with one track, its tables before the pictures, so that it plays while it is loaded.
//!
//! Sources: ISO/IEC 14496-12 (boxes), 14496-15 (`avcC`).

use super::encoder::Encoder;

/// How finely times are counted, in parts of a picture: who plays a film faster needs parts.
const TICKS: u32 = 100;

/// A box: its size, its name, its content.
fn put(name: [u8; 4], content: &[u8]) -> Vec<u8> {
    let mut out = (content.len() as u32 + 8).to_be_bytes().to_vec();
    out.extend(name);
    out.extend(content);
    out
}

/// A box that has a version, 0, and flags.
fn full(name: [u8; 4], flags: u32, content: &[u8]) -> Vec<u8> {
    put(name, &[&flags.to_be_bytes(), content].concat())
}

fn words(all: &[u32]) -> Vec<u8> {
    all.iter().flat_map(|word| word.to_be_bytes()).collect()
}

/// The matrix that leaves a picture as it is.
fn upright() -> Vec<u8> {
    words(&[0x10000, 0, 0, 0, 0x10000, 0, 0, 0, 0x4000_0000])
}

/// Returns the file: `coded` pictures, each with whether it stands by itself, `rate` a second.
pub(super) fn file(encoder: &Encoder, rate: u32, coded: &[(Vec<u8>, bool)]) -> Vec<u8> {
    let head = put(*b"ftyp", &[b"isom".as_slice(), &words(&[0x200]), b"isomiso2avc1mp41"].concat());
    // The tables have to say where the pictures begin, and are as long whatever they say.
    let tables = |from: u32| movie(encoder, rate, coded, from);
    let from = head.len() + tables(0).len() + 8;
    let mut pictures = Vec::new();
    for (unit, _) in coded {
        pictures.extend((unit.len() as u32).to_be_bytes());
        pictures.extend(unit);
    }
    [head, tables(from as u32), put(*b"mdat", &pictures)].concat()
}

fn movie(encoder: &Encoder, rate: u32, coded: &[(Vec<u8>, bool)], from: u32) -> Vec<u8> {
    let n = coded.len() as u32;
    let (width, height) = encoder.size;
    let film = [
        words(&[0, 0, rate * TICKS, n * TICKS, 0x10000, 0x0100_0000, 0, 0]),
        upright(),
        words(&[0; 6]),
        words(&[2]),
    ];
    let track = [
        words(&[0, 0, 1, 0, n * TICKS, 0, 0, 0, 0]),
        upright(),
        words(&[width << 16, height << 16]),
    ];
    let media = [words(&[0, 0, rate * TICKS, n * TICKS]), vec![0x55, 0xc4, 0, 0]];
    let handler = [words(&[0]), b"vide".to_vec(), words(&[0; 3]), b"camera and twin\0".to_vec()];
    let reference = full(*b"dref", 0, &[words(&[1]), full(*b"url ", 1, &[])].concat());
    let samples = put(*b"stbl", &samples(encoder, coded, from));
    let information =
        [full(*b"vmhd", 1, &words(&[0, 0])), put(*b"dinf", &reference), samples].concat();
    let media = [
        full(*b"mdhd", 0, &media.concat()),
        full(*b"hdlr", 0, &handler.concat()),
        put(*b"minf", &information),
    ];
    let track = [full(*b"tkhd", 3, &track.concat()), put(*b"mdia", &media.concat())];
    put(*b"moov", &[full(*b"mvhd", 0, &film.concat()), put(*b"trak", &track.concat())].concat())
}

/// Where each picture is, and how it is coded.
fn samples(encoder: &Encoder, coded: &[(Vec<u8>, bool)], from: u32) -> Vec<u8> {
    let n = coded.len() as u32;
    let (width, height) = encoder.size;
    let (sequence, parameters) = (encoder.sequence(), Encoder::parameters());
    let length = |unit: &[u8]| (unit.len() as u16).to_be_bytes();
    let profile = &sequence[1..4];
    let coding = [
        &[1],
        profile,
        &[0xff, 0xe1],
        &length(&sequence),
        &sequence,
        &[1],
        &length(&parameters),
        &parameters,
    ];
    let mut entry = words(&[0, 1, 0, 0, 0, 0]);
    entry.extend(words(&[width << 16 | height, 0x0048_0000, 0x0048_0000, 0]));
    // One picture a sample; a name of no letters; 24 bits of colour.
    entry.extend(1_u16.to_be_bytes());
    entry.extend([0; 32]);
    entry.extend([0, 24, 0xff, 0xff]);
    entry.extend(put(*b"avcC", &coding.concat()));
    let whole: Vec<u32> =
        (1..).zip(coded).filter(|(_, (_, is_whole))| *is_whole).map(|(at, _)| at).collect();
    let sizes: Vec<u32> = coded.iter().map(|(unit, _)| unit.len() as u32 + 4).collect();
    [
        full(*b"stsd", 0, &[words(&[1]), put(*b"avc1", &entry)].concat()),
        full(*b"stts", 0, &words(&[1, n, TICKS])),
        full(*b"stss", 0, &[words(&[whole.len() as u32]), words(&whole)].concat()),
        full(*b"stsc", 0, &words(&[1, 1, n, 1])),
        full(*b"stsz", 0, &[words(&[0, n]), words(&sizes)].concat()),
        full(*b"stco", 0, &words(&[1, from])),
    ]
    .concat()
}
