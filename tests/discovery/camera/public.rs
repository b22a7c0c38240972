//! Real cameras: public calibration pictures, begun from a camera without distortion.
#![expect(clippy::print_stderr, reason = "what was measured is for people to read")]

use std::fmt::Write as _;

use trueup::discovery::Options;
use trueup::discovery::camera::investigate;
use trueup::discovery::finding::Finding;

use super::points;
use crate::absent::public;

fn told(set: &str, finding: &Finding) {
    eprintln!(
        "{set}: {:?}; held out {:.3} -> {:.3} of noise ({:.3} px)",
        finding.verdict,
        finding.gap.before.heldout,
        finding.gap.after.heldout,
        finding.places[0].noise
    );
    for effect in &finding.effects {
        eprintln!("  {}: {} {:?}", effect.name, effect.equation, effect.evidence);
    }
    for note in &finding.notes {
        eprintln!("  note: {note}");
    }
}

fn analysed(table: &str, sidecar: &str) -> Finding {
    let file = points("points.csv", table, sidecar).unwrap();
    investigate(&[file], None, &[], &Options::default(), &mut |_, _| {}).unwrap().finding
}

/// 13 views of a chessboard, corners as `OpenCV` found them; its focal length and centre are given, its lens is not.
#[test]
fn the_chessboards_have_a_barrel_lens() {
    let Some(dir) = public("opencv_chessboard") else { return };
    let mut table = String::from("x[m],y[m],z[m],u[px],v[px],view\n");
    let text = std::fs::read_to_string(dir.join("corners_left_cv2.csv")).unwrap();
    for line in text.lines().skip(1) {
        let cells: Vec<&str> = line.split(',').collect();
        let at = |i: usize| cells[i].parse::<f64>().unwrap() * 0.025;
        writeln!(table, "{},{},0,{},{},{}", at(3), at(2), cells[4], cells[5], cells[0]).unwrap();
    }
    let camera = r#"{"fx_px": 532.827, "fy_px": 532.946, "cx_px": 342.487, "cy_px": 233.856}"#;
    let finding = analysed(&table, camera);
    told("chessboards", &finding);
    let radial = finding.effects.iter().find(|e| e.name == "radial_distortion").expect("named");
    let k1 = serde_json::to_value(&radial.parameters["k1"]).unwrap()["value"].as_f64().unwrap();
    assert!((k1 + 0.2809).abs() < 0.03, "{k1}");
    assert!(radial.evidence.heldout_gain > 0.8, "{:?}", radial.evidence);
    assert!(finding.gap.shrink_heldout > 0.9, "{:?}", finding.gap);
}

/// Zhang's five views: published focal lengths, centre and skew, no lens.
#[test]
fn zhangs_views_have_his_lens() {
    let Some(dir) = public("zhang_planar") else { return };
    let numbers = |name: &str| -> Vec<f64> {
        let text = std::fs::read_to_string(dir.join(name)).unwrap();
        text.split_whitespace().filter_map(|word| word.parse().ok()).collect()
    };
    let model = numbers("Model.txt");
    let mut table = String::from("x[m],y[m],z[m],u[px],v[px],view\n");
    for view in 1..=5 {
        let seen = numbers(&format!("data{view}.txt"));
        for (at, pixel) in model.chunks_exact(2).zip(seen.chunks_exact(2)) {
            let [x, y] = [at[0] * 0.0254, at[1] * 0.0254];
            writeln!(table, "{x},{y},0,{},{},{view}", pixel[0], pixel[1]).unwrap();
        }
    }
    let camera = r#"{"camera": {"fx_px": 832.5, "fy_px": 832.53, "cx_px": 303.959, "cy_px": 206.585,
        "skew_px": 0.204494}}"#;
    let finding = analysed(&table, camera);
    told("zhang", &finding);
    let radial = finding.effects.iter().find(|e| e.name == "radial_distortion").expect("named");
    let k1 = serde_json::to_value(&radial.parameters["k1"]).unwrap()["value"].as_f64().unwrap();
    assert!((k1 + 0.2286).abs() < 0.03, "{k1}");
    assert!(finding.gap.shrink_heldout > 0.8, "{:?}", finding.gap);
}
