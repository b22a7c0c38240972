//! The film in a run folder: its pictures are there before its table tells of them, and it is read as far as it goes.

use std::fs::OpenOptions;
use std::io::Write as _;
use std::sync::Arc;

use image::RgbImage;
use trueup::trace::{Event, Observer, Still, small_jpeg};
use trueup::workcell::film;
use trueup::workcell::record::Recorder;

use crate::program::Scratch;

fn still(number: usize) -> Event {
    let picture = small_jpeg(&RgbImage::from_pixel(16, 9, image::Rgb([90, 20, 10])));
    Event::Still(Arc::new(Still {
        number,
        time: 0.2 * number as f64,
        step: 3,
        real: (number > 1).then(|| picture.clone()),
        twin: Some(picture),
        water: vec![("jar".into(), 149.25e-6), ("cup".into(), 0.5e-6)],
        spilt: 0.25e-6,
    }))
}

#[test]
fn a_film_is_read_back_as_far_as_it_was_written() {
    let scratch = Scratch::new("film");
    let mut recorder = Recorder::create(&scratch.path("runs"), "now", "x").unwrap();
    assert_eq!(film::read(recorder.dir()), film::Film::default());
    assert!(!recorder.dir().join("film").exists(), "a run in which nothing moves has no film");
    for number in 1..=3 {
        recorder.event(&still(number));
    }
    recorder.save(&serde_json::json!({})).unwrap();
    let dir = recorder.dir().to_owned();
    let read = film::read(&dir);
    assert_eq!(read.vessels, ["jar", "cup", "spilt"]);
    assert_eq!(read.moments.len(), 3);
    let second = &read.moments[1];
    assert_eq!((second.number, second.step), (2, 3));
    assert!((second.time - 0.4).abs() < 1e-9 && second.water_ml == [149.25, 0.5, 0.25]);
    // A camera that gave nothing is left out, and the rest is there.
    assert!(!film::picture(&dir, 1, "real").exists());
    for (number, whose) in [(1, "twin"), (2, "real"), (3, "twin")] {
        assert_eq!(image::image_dimensions(film::picture(&dir, number, whose)).unwrap(), (16, 9));
    }
    let mut table = OpenOptions::new().append(true).open(dir.join("film/film.csv")).unwrap();
    table.write_all(b"4,0.800,3,149").unwrap();
    assert_eq!(film::read(&dir).moments.len(), 3, "a line that is cut off is no moment");
}
