//! A look that somebody ends: it tells nothing, and one that nobody ends is the same as without being asked.

use std::sync::atomic::{AtomicUsize, Ordering};

use trueup::alignment::vision::{Look, Options, Sighting};
use trueup::world::Pose;

use super::paint::{Light, Painter, true_camera};
use crate::kitchen;

/// All of a sighting that is a number or a name.
fn told(seen: &[Sighting]) -> Vec<String> {
    let one = |s: &Sighting| {
        let places = (s.world_from_object, s.likeliest);
        format!("{} {} {} {places:?} {:?} {:?}", s.name, s.confidence, s.std, s.score, s.checks)
    };
    seen.iter().map(one).collect()
}

#[test]
fn a_look_that_is_stopped_tells_nothing_and_one_that_is_not_is_the_same() {
    let (scene, camera) = (kitchen::scene(), true_camera());
    let mut painter = Painter::new(&camera, [70, 72, 75]);
    painter.table(&scene);
    painter.object(&scene.objects[1], &Pose::upright(0.6, 0.1, 0.0, 0.0));
    let image = painter.finish(&Light::even(70));
    let options = Options::default();
    let look = || Look::new(&image, &camera, &scene).unwrap();
    let alone = look().see(&options);

    let asked = AtomicUsize::new(0);
    let never = || {
        asked.fetch_add(1, Ordering::SeqCst);
        false
    };
    let whole = look().until(&never);
    let seen = whole.see(&options);
    assert!(!whole.is_stopped());
    assert_eq!(told(&seen), told(&alone));

    // Wherever the wish comes, and though it is forgotten right after.
    let in_all = asked.load(Ordering::SeqCst);
    assert!(in_all > 10, "asked {in_all} times");
    for at in [0, in_all / 2] {
        let asked = AtomicUsize::new(0);
        let once = || asked.fetch_add(1, Ordering::SeqCst) == at;
        let cut = look().until(&once);
        assert!(cut.see(&options).is_empty() && cut.is_stopped(), "at {at} of {in_all}");
        assert!(cut.unexplained(&[], &options, &[]).is_empty());
    }
}
