//! Thick liquids and full vessels, made by other means than the model: a sheet of liquid along the wall of a
//! tilted jar in sixty cells, and a cup with a weir for a rim under a pour of particles.

use std::fmt::Write as _;

use trueup::discovery::finding::{Finding, Verdict};
use trueup::discovery::recording::{Map, Recording};
use trueup::discovery::{Options, Subject, investigate};

use super::number;
use super::pour::poured_over;
use crate::kitchen;

/// Pours a liquid of `viscosity` (Pa·s) out of a box 59 x 59 x 137 mm inside and returns the scale's recording.
///
/// Lubrication: the depth over the lower wall flows down its surface with `ρ g D³ / (3 μ)` times the slope of the
/// surface, and over the lip as a sheet that falls. No level plane, no single time constant.
fn sheet(viscosity: f64, seed: u64) -> Recording {
    const CELLS: usize = 60;
    let (width, height, filled) = (0.059_f64, 0.137_f64, 150e-6);
    let cell = height / CELLS as f64;
    let (mut csv, mut noise) = ("t[s],tilt[deg],mass[g]\n".to_owned(), seed);
    let weight = 1000.0 * 9.81 / (3.0 * viscosity);
    let tilt = |t: f64| (0.9 + 0.21 * (t - 1.0).max(0.0)).min(1.45);
    // Level at first: the volume as it stands at the tilt of the beginning, found by halving.
    let floor = |i: usize, tilt: f64| (i as f64 + 0.5) * cell * tilt.cos();
    let stands = |level: f64, i: usize, tilt: f64| {
        // The wall opposite bounds the depth.
        (level - floor(i, tilt)).clamp(0.0, width / tilt.sin())
    };
    let (mut low, mut high) = (0.0, 0.3);
    for _ in 0..60 {
        let level = 0.5 * (low + high);
        let volume: f64 =
            (0..CELLS).map(|i| stands(level, i, tilt(0.0)) * tilt(0.0).sin() * cell * width).sum();
        if volume < filled { low = level } else { high = level }
    }
    let mut depth: Vec<f64> = (0..CELLS).map(|i| stands(low, i, tilt(0.0))).collect();
    let (mut time, mut out, mut row) = (0.0, 0.0, 0);
    while time < 20.0 {
        let angle = tilt(time);
        let (sin, cos) = angle.sin_cos();
        // Vertical depth; the sheet's own thickness is across the wall.
        let thick = |d: f64| d * sin;
        let most = depth.iter().copied().fold(1e-4, f64::max);
        let step = (0.2 * cell * cell / (weight * thick(most).powi(3))).min(1e-3);
        let mut flux = [0.0; CELLS + 1];
        for i in 0..CELLS - 1 {
            let surface = |k: usize| floor(k, angle) + depth[k];
            let slope = (surface(i) - surface(i + 1)) / cell;
            let upstream = if slope > 0.0 { depth[i] } else { depth[i + 1] };
            flux[i + 1] = weight * thick(upstream).powi(3) * slope;
        }
        // Over the lip it falls down the outside.
        let brink = depth[CELLS - 1] - 0.5 * cell * cos;
        flux[CELLS] = weight * thick(brink.max(0.0)).powi(3);
        for i in 0..CELLS {
            depth[i] = (depth[i] + step * (flux[i] - flux[i + 1]) / (cell * sin)).max(0.0);
        }
        out += step * flux[CELLS] * width;
        time += step;
        while f64::from(row) * 0.05 <= time {
            noise = noise.wrapping_mul(0x5851_F42D_4C95_7F2D).wrapping_add(0x1405_7B7E_F767_814F);
            let even = (noise >> 40) as f64 / f64::from(1_u32 << 23) - 1.0;
            let mass = out * 1e6 + 0.3 * 3.0_f64.sqrt() * even;
            writeln!(csv, "{:.3},{:.3},{mass:.2}", f64::from(row) * 0.05, angle.to_degrees())
                .unwrap();
            row += 1;
        }
    }
    let mut recording =
        Recording::read(&format!("sheet {seed}"), &csv, None, &Map::default()).unwrap();
    recording.sidecar.pour = Some(trueup::discovery::recording::sidecar::Vessels {
        source: "jar".into(),
        target: "cup".into(),
        held_m3: Some(filled),
        first_m3: None,
        there_m3: None,
        spilt_m3: None,
        borne_kg: None,
    });
    recording
}

fn found(recordings: &[Recording]) -> Finding {
    let scene = kitchen::scene();
    let subject = Subject::Pours(&scene, &[]);
    investigate(recordings, subject, &Options::default(), &mut |_, _| {}).unwrap().finding
}

#[test]
fn a_thick_liquid_is_named_and_not_taken_for_a_slow_pace() {
    for viscosity in [0.5, 2.0] {
        let finding = found(&[sheet(viscosity, 1), sheet(viscosity, 2)]);
        assert_eq!(finding.effects[0].name, "liquid_viscosity", "{:#?}", finding.effects);
        assert_eq!(finding.effects[0].at, "jar");
        // One head over the lip stands for a surface that slopes: the number is an effective one.
        let seen = number(&finding, "liquid_viscosity", "viscosity");
        assert!((0.6..1.7).contains(&(seen / viscosity)), "{seen} for {viscosity} Pa·s");
        assert!(finding.gap.shrink_heldout > 0.8, "{:?}", finding.gap);
    }
}

#[test]
fn a_cup_that_runs_over_is_named_when_the_table_is_weighed_too() {
    let pours = [poured_over(110e-6, 1), poured_over(110e-6, 2)];
    let finding = found(&pours);
    let level = 1e6 * number(&finding, "overflow", "level");
    assert_eq!(finding.verdict, Verdict::Named, "{:#?}", finding.effects);
    assert_eq!(finding.effects[0].at, "cup");
    // A crest stands above the rim for a while; the model has none.
    assert!((level - 110.0).abs() < 4.0, "{level} mL");

    // Without the scales under the table a scale that ends at its limit reads the same.
    let blind: Vec<Recording> = pours
        .into_iter()
        .map(|mut pour| {
            pour.sidecar.pour.as_mut().unwrap().spilt_m3 = None;
            pour
        })
        .collect();
    let finding = found(&blind);
    assert_eq!(finding.verdict, Verdict::Ambiguous, "{:#?}", finding.effects);
    let names: Vec<&str> = finding.effects.iter().map(|effect| effect.name.as_str()).collect();
    assert!(names.contains(&"overflow") && names.contains(&"output_saturation"), "{names:?}");
}
