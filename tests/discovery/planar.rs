//! An arm of two joints that moves in a vertical plane: its base that leans along the plane and the zero of its first encoder
//! are one and the same, and neither is named without the other.
//!
//! The tilt has a second number, which does nothing there. What that costs spoke for the encoder, or not, by the order of the files.

use std::fmt::Write as _;

use nalgebra::Vector3;
use trueup::discovery::finding::Verdict;
use trueup::discovery::recording::{Map, Recording};
use trueup::discovery::{Options, Subject, investigate};
use trueup::motion::Robot;
use trueup::motion::dynamics::{Bodies, Dynamics, GRAVITY};

const ARM: &str = r#"<robot name="planar">
<link name="base_link"/>
<link name="link_1"><inertial><origin xyz="0.14 0 0"/><mass value="2.4"/><inertia ixx="0.0014" ixy="0" ixz="0" iyy="0.0212" iyz="0" izz="0.0212"/></inertial></link>
<joint name="joint_1" type="revolute"><parent link="base_link"/><child link="link_1"/><origin xyz="0 0 0.6" rpy="1.5708 0 0"/><axis xyz="0 0 1"/><limit lower="-3" upper="3" effort="60" velocity="8"/></joint>
<link name="link_2"><inertial><origin xyz="0.11 0 0"/><mass value="1.1"/><inertia ixx="0.0005" ixy="0" ixz="0" iyy="0.0064" iyz="0" izz="0.0064"/></inertial></link>
<joint name="joint_2" type="revolute"><parent link="link_1"/><child link="link_2"/><origin xyz="0.3 0 0"/><axis xyz="0 0 1"/><limit lower="-2.7" upper="2.7" effort="25" velocity="10"/></joint>
<link name="flange"/><joint name="flange_fixed" type="fixed"><parent link="link_2"/><child link="flange"/><origin xyz="0 0 0.25"/></joint>
</robot>"#;

/// 12 s in which both joints swing, on a base that leans by `tilt` and with a first joint that stands at its encoder plus `zero`, rad.
fn recording(robot: &Robot, tilt: f64, zero: f64, seed: u64) -> Recording {
    let gravity = GRAVITY * Vector3::new(tilt.sin(), 0.0, -tilt.cos());
    let arm = Dynamics::new(robot, Bodies::All).with_gravity(gravity);
    let mut state = seed;
    let mut chance = move || {
        let mut sum = 0.0;
        for _ in 0..4 {
            state = state.wrapping_mul(0x5851_F42D_4C95_7F2D).wrapping_add(0x1405_7B7E_F767_814F);
            sum += (state >> 40) as f64 / f64::from(1_u32 << 24) - 0.5;
        }
        sum * 3.0_f64.sqrt()
    };
    let mut csv =
        "t[s],q_1[rad],q_2[rad],dq_1[rad/s],dq_2[rad/s],tau_1[N*m],tau_2[N*m]\n".to_owned();
    for row in 0..1200 {
        let t = f64::from(row) * 0.01;
        let (mut q, mut dq, mut ddq) = ([0.4, 0.2], [0.0; 2], [0.0; 2]);
        for j in 0..2 {
            let (size, rate) = (0.9 - 0.1 * j as f64, 1.1 + 0.6 * j as f64);
            let phase = j as f64 + 0.7 * seed as f64;
            q[j] += size * (rate * t + phase).sin();
            dq[j] = size * rate * (rate * t + phase).cos();
            ddq[j] = -size * rate * rate * (rate * t + phase).sin();
        }
        let tau = arm.inverse(&q, &dq, &ddq).unwrap();
        let q = [q[0] - zero + 5e-5 * chance(), q[1] + 5e-5 * chance()];
        let dq = dq.map(|dq| dq + 1e-3 * chance());
        let tau = [tau[0] + 0.1 * chance(), tau[1] + 0.04 * chance()];
        write!(csv, "{t:.3},{:.6},{:.6},{:.6},{:.6}", q[0], q[1], dq[0], dq[1]).unwrap();
        writeln!(csv, ",{:.5},{:.5}", tau[0], tau[1]).unwrap();
    }
    let sidecar = r#"{"torque_sensor": "motor"}"#;
    let name = format!("planar {seed}");
    Recording::read(&name, &csv, Some(("sidecar", sidecar)), &Map::default()).unwrap()
}

#[test]
fn a_tilt_in_the_plane_of_the_arm_is_told_beside_the_zero_of_its_encoder() {
    let robot = Robot::from_urdf(ARM, None).unwrap();
    for (tilt, zero) in [(0.04, 0.0), (0.0, 0.03)] {
        for order in [[1, 2], [2, 1]] {
            let recordings = order.map(|seed| recording(&robot, tilt, zero, seed));
            let (subject, options) = (Subject::Arm(&robot, &[]), Options::default());
            let found = investigate(&recordings, subject, &options, &mut |_, _| {}).unwrap();
            let finding = found.finding;
            let case = format!("tilt {tilt}, zero {zero}, {order:?}: {:#?}", finding.effects);
            assert_eq!(finding.verdict, Verdict::Ambiguous, "{case}");
            for (name, at) in [("joint_zero_offset", "joint_1"), ("base_tilt", "base")] {
                let is = |e: &&trueup::discovery::finding::Effect| e.name == name && e.at == at;
                assert!(finding.effects.iter().any(|e| is(&e)), "no {name}; {case}");
            }
        }
    }
}

/// The zero of a joint whose axis goes through its link's centre does nothing: it "would have been seen" from so many turns on as
/// rounding asks for.
#[test]
fn what_does_nothing_would_have_been_seen_at_no_size() {
    let balanced = ARM.replace(r#"<origin xyz="0.11 0 0"/>"#, "");
    let robot = Robot::from_urdf(&balanced, None).unwrap();
    let recordings = [1, 2].map(|seed| recording(&robot, 0.0, 0.0, seed));
    let (subject, options) = (Subject::Arm(&robot, &[]), Options::default());
    let finding = investigate(&recordings, subject, &options, &mut |_, _| {}).unwrap().finding;
    assert_eq!(finding.verdict, Verdict::NothingMissing, "{finding:#?}");
    let zero = |at: &str| {
        finding.smallest_visible.iter().any(|s| s.name == "joint_zero_offset" && s.at == at)
    };
    assert!(zero("joint_1") && !zero("joint_2"), "{:#?}", finding.smallest_visible);
    let is_said =
        |note: &String| note.contains("cannot show") && note.contains("joint_zero_offset(joint_2)");
    assert!(finding.notes.iter().any(is_said), "{:?}", finding.notes);
}
