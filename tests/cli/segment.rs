//! `trueup camera segment`: a thing cut out from a box, a point, a rough mask, or nothing said.

use std::fs;

use image::{GrayImage, Luma, Rgb, RgbImage};

use crate::program::Scratch;

/// A disc of this radius, px, in the middle of a lighter table with a slope of light.
const RADIUS: f64 = 45.0;

fn inside(x: u32, y: u32) -> bool {
    (f64::from(x) - 150.0).hypot(f64::from(y) - 110.0) < RADIUS
}

fn disc() -> RgbImage {
    RgbImage::from_fn(320, 240, |x, y| {
        let light = 150 + (x / 10) as u8;
        Rgb(if inside(x, y) { [60, 90, 160] } else { [light, light, light - 10] })
    })
}

/// What a mask shares with the disc over what either has.
fn overlap(mask: &GrayImage) -> f64 {
    let (mut both, mut either) = (0.0, 0.0);
    for (x, y, pixel) in mask.enumerate_pixels() {
        let (a, b) = (pixel.0[0] > 0, inside(x, y));
        both += f64::from(u8::from(a && b));
        either += f64::from(u8::from(a || b));
    }
    both / either
}

#[test]
fn a_disc_is_cut_out_whatever_is_said_of_where_it_is() {
    let scratch = Scratch::new("segment-disc");
    disc().save(scratch.path("photo.png")).unwrap();
    // A square of which the corners are beside the disc, and from which a tenth of the disc sticks out on the right.
    let rough = GrayImage::from_fn(320, 240, |x, y| {
        Luma([if (105..185).contains(&x) && (70..150).contains(&y) { 255 } else { 0 }])
    });
    rough.save(scratch.path("rough.png")).unwrap();
    for (dir, prompt) in [
        ("box", vec!["--box", "90,50,210,170"]),
        ("point", vec!["--point", "150,110"]),
        ("mask", vec!["--mask", "rough.png"]),
        ("none", vec![]),
    ] {
        let mut args = vec!["camera", "segment", "photo.png", "--json", "--out", dir];
        args.extend(prompt);
        let answer = scratch.trueup(&args).json();
        let cut = &answer["segments"][0];
        let mask = image::open(scratch.path(&format!("{dir}/mask-1.png"))).unwrap().to_luma8();
        assert!(overlap(&mask) > 0.95, "{dir}: {}", overlap(&mask));
        assert_eq!(cut["mask"], format!("{dir}/mask-1.png"));
        // The contour runs round the disc, within three pixels of its border: half of a cell and the smoothing.
        let contour = cut["contour_px"].as_array().unwrap();
        assert!(contour.len() > 200, "{dir}: {}", contour.len());
        for point in contour {
            let [u, v] = [0, 1].map(|k| point[k].as_f64().unwrap());
            let off = (u - 150.0).hypot(v - 110.0) - RADIUS;
            assert!(off.abs() < 3.0, "{dir}: {off}");
        }
        assert!(cut["is_smooth"] == true && cut["agreement"].as_f64().unwrap() > 0.8, "{cut}");
        assert!(fs::metadata(scratch.path(&format!("{dir}/segmented.png"))).is_ok());
    }
}

#[test]
fn where_nothing_is_that_is_said_and_a_prompt_beside_the_picture_is_refused() {
    let scratch = Scratch::new("segment-none");
    RgbImage::from_pixel(320, 240, Rgb([120; 3])).save(scratch.path("flat.png")).unwrap();
    let said = scratch.trueup(&["camera", "segment", "flat.png"]);
    assert_eq!(said.code, 1, "{said:?}");
    assert!(said.out.contains("nothing stands out"), "{said:?}");
    GrayImage::new(320, 240).save(scratch.path("black.png")).unwrap();
    GrayImage::from_pixel(32, 24, Luma([255])).save(scratch.path("small.png")).unwrap();
    for prompt in [
        ["--box", "400,10,500,100"],
        ["--box", "100,100,90,90"],
        ["--point", "10,240"],
        ["--mask", "black.png"],
        ["--mask", "small.png"],
    ] {
        let mut args = vec!["camera", "segment", "flat.png", "--json"];
        args.extend(prompt);
        let said = scratch.trueup(&args);
        assert_eq!((said.code, said.error("code").as_str()), (2, "camera::prompt"), "{said:?}");
    }
    let said = scratch.trueup(&["camera", "segment", "flat.png", "--box", "1,2,3"]);
    assert!(said.err.contains("4 numbers of pixels"), "{said:?}");
}
