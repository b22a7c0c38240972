use super::paint::{Light, Painter, kitchen, true_camera};
use super::visp::{Visp, folder};
use trueup::alignment::vision::{Options, see};
use trueup::world::Pose;

#[test]
fn visp_frames() {
    let Some(folder) = folder() else { return };
    for frame in (0..=200).step_by(20) {
    let visp = Visp::read(&folder, Some(frame));
        let (cube, axis) = visp.truth(frame);
        let s = see(&visp.image(frame), &visp.camera, &visp.scene, &Options::default()).unwrap();
        for (k, s) in s.iter().enumerate() {
            let p = s.world_from_object.unwrap_or(Pose::upright(9., 9., 0., 0.));
            let truth = if k == 0 { cube.origin() } else { axis };
            let d = (p.origin() - truth).xy().norm() * 1e3;
            let turn = (p.yaw() - cube.yaw()).rem_euclid(std::f64::consts::FRAC_PI_2);
            let turn = turn.min(std::f64::consts::FRAC_PI_2 - turn).to_degrees();
            println!("{frame} {} d={d:.1}mm yaw={turn:.2} gap={:.3} {:?} rms {:?}", s.name, s.gap, s.score, s.candidate.and_then(|c| c.fit).map(|f| (f.rms_px, f.support, f.covariance[(0,0)].sqrt())));
        }
    }
}

#[test]
fn kitchen_truth() {
    let (scene, camera) = (kitchen(), true_camera());
    for (seed, jar, cup, slope, gain) in [
        (1u64, (0.55, -0.2, 0.3), (0.6, 0.15), [0.0, 0.0], 1.0),
        (2, (0.62, 0.05, 0.0), (0.5, -0.2), [0.6, -0.3], 0.8),
        (3, (0.5, 0.25, 0.7), (0.7, -0.1), [-0.4, 0.3], 1.15),
        (4, (0.45, 0.0, 0.5), (0.6, 0.02), [0.0, 0.0], 0.7),
        (5, (2.45, 0.0, 0.5), (0.6, 0.02), [0.0, 0.0], 1.0),
        (6, (0.5, 0.0, 0.5), (2.6, 0.02), [0.0, 0.0], 1.0),
    ] {
        let mut painter = Painter::new(&camera, [70, 72, 75]);
        painter.table(&scene);
        let jp = Pose::upright(jar.0, jar.1, 0.0, jar.2);
        let cp = Pose::upright(cup.0, cup.1, 0.0, 0.0);
        if jar.0 < 1.0 { painter.object(&scene.objects[0], &jp); }
        if cup.0 < 1.0 { painter.object(&scene.objects[1], &cp); }
        let image = painter.finish(&Light { gain, slope, noise: 1.5, seed });
        image.save(format!("/tmp/k{seed}.png")).unwrap();
        let t = std::process::Command::new("date").arg("+%s.%N").output().unwrap();
        print!("{}", String::from_utf8(t.stdout).unwrap());
        let s = see(&image, &camera, &scene, &Options::default()).unwrap();
        for (k, s) in s.iter().enumerate() {
            let p = s.world_from_object.unwrap_or(Pose::upright(9., 9., 0., 0.));
            let truth = [jp, cp][k];
            let d = (p.origin() - truth.origin()).norm() * 1e3;
            println!("{seed} {} d={d:.2}mm yaw={:.2} gap={:.3} {:?} rms {:?}", s.name, (p.yaw() - truth.yaw()).to_degrees(), s.gap, s.score, s.candidate.and_then(|c| c.fit).map(|f| (f.rms_px, f.support, f.covariance[(0,0)].sqrt())));
        }
    }
}

#[test]
fn jar_debug() {
    use trueup::alignment::outline::*; use trueup::alignment::picture::*; use trueup::alignment::placement::*; use trueup::alignment::refine;
    let (scene, camera) = (kitchen(), true_camera());
    let image = image::open("/tmp/k2.png").unwrap().to_rgb8();
    let picture = Picture::new(&image); let view = Projector::new(&camera);
    let truth = Pose::upright(0.62,0.05,0.0,0.0);
    let o = Outline::new(&view, &scene.objects[0].shape, &truth, 24);
    let mut e: std::collections::BTreeMap<usize, Vec<String>> = Default::default();
    for s in o.samples.iter().step_by(4) { e.entry(s.edge).or_default().push(format!("{:?}", refine::strongest(&picture, s.pixel, s.normal, (0.9, 4.0, 2)).map(|r| (( r.0*10.).round()/10., (r.1*10.).round()/10.)))); }
    for (k, v) in e { println!("edge {k} {:?}: {}", o.samples[k*24].kind, v.join(" ")); }
    let f = refine::refine(&picture, &view, &scene.objects[0].shape, &truth, &Hidden::default(), 0.9, scene.objects[0].material);
    println!("{f:?}");
}
