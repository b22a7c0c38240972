use super::*;
use std::time::Instant;
#[test]
#[ignore]
fn bench() {
    let (mut twin, _low, high) = super::grasp::before_grasp(1.5e-4, |_| {});
    let t = Instant::now();
    twin.run(0.5).unwrap();
    println!("rest frozen {}x", 0.5 / t.elapsed().as_secs_f64());
    twin.grip(0.0, 0.1, 40.0).unwrap();
    twin.run(0.8).unwrap();
    let t = Instant::now();
    drive(&mut twin, &high, 1.0);
    println!("lift {}x frozen {}", 1.0 / t.elapsed().as_secs_f64(), twin.fluid().is_frozen());
    let mut end = high.clone();
    end[6] += 0.5;
    let t = Instant::now();
    drive(&mut twin, &end, 0.5);
    println!("tilt {}x frozen {}", 0.5 / t.elapsed().as_secs_f64(), twin.fluid().is_frozen());
}
