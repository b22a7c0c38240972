//! Limits are kept at every instant; starts and ends are exact.

use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};
use trueup::motion::trajectory::{Limits, Trajectory};
use trueup::motion::{Error, Robot};

/// Samples every millisecond and checks limits, the jerk's by differences, and that speed and acceleration are derivatives.
fn lawful(trajectory: &Trajectory, limits: &Limits) {
    let n = (trajectory.duration() / 1e-3).ceil() as usize;
    let mut last = trajectory.sample(0.0);
    for k in 0..=n {
        let t = (k as f64 * 1e-3).min(trajectory.duration());
        let now = trajectory.sample(t);
        for i in 0..now.q.len() {
            assert!(now.dq[i].abs() <= limits.velocity[i], "speed {i} at {t}");
            assert!(now.ddq[i].abs() <= limits.acceleration[i], "acceleration {i} at {t}");
            if k > 0 && k < n {
                let mean = 0.5 * (now.dq[i] + last.dq[i]);
                assert!((now.q[i] - last.q[i] - 1e-3 * mean).abs() < 1e-5, "{i} at {t}");
                let jerk = (now.ddq[i] - last.ddq[i]).abs() / 1e-3;
                assert!(jerk <= limits.jerk[i], "jerk {i} at {t}: {jerk}");
            }
        }
        last = now;
    }
}

/// `TRUEUP_PATHS` says how many of each kind are tried; a hundred thousand looks of each are enough for every day.
#[test]
fn random_paths_keep_every_limit_at_every_millisecond() {
    let robot = Robot::gen3();
    let limits = Limits::of(&robot);
    let mut random = StdRng::seed_from_u64(4);
    let paths = std::env::var("TRUEUP_PATHS").ok().and_then(|n| n.parse().ok()).unwrap_or(25);
    for (corners, size) in [(2, 2.0), (2, 0.05), (3, 1.5), (5, 1.0), (9, 0.5)] {
        for _ in 0..paths {
            let path: Vec<Vec<f64>> = (0..corners)
                .map(|_| (0..7).map(|_| random.random_range(-size..size)).collect())
                .collect();
            let trajectory =
                Trajectory::through_corners(&path, &limits, 0.3, &|_, _| true).unwrap();
            lawful(&trajectory, &limits);
            assert_eq!(trajectory.sample(0.0).q, path[0]);
            let end = trajectory.sample(trajectory.duration());
            assert_eq!(&end.q, path.last().unwrap());
            assert!(end.dq.iter().all(|x| *x == 0.0));
        }
    }
    // A way that wanders: every one of its hundred points bends it.
    for _ in 0..paths {
        let mut q: Vec<f64> = (0..7).map(|_| random.random_range(-1.0..1.0)).collect();
        let mut step = vec![0.02; 7];
        let points: Vec<Vec<f64>> = (0..100)
            .map(|_| {
                for (q, step) in q.iter_mut().zip(&mut step) {
                    *step += random.random_range(-0.002..0.002);
                    *q += *step;
                }
                q.clone()
            })
            .collect();
        lawful(&Trajectory::through_points(&points, &limits).unwrap(), &limits);
    }
}

#[test]
fn a_jerk_limit_of_a_robot_s_own_is_kept() {
    let limits = Limits { jerk: vec![4.0, 40.0], ..Limits::new(vec![1.0; 2], vec![2.0; 2]) };
    let corner = [vec![0.0, 0.0], vec![0.4, 0.1], vec![0.3, 0.9]];
    let slow = Trajectory::through_corners(&corner, &limits, 0.1, &|_, _| true).unwrap();
    lawful(&slow, &limits);
    let limits = Limits { jerk: vec![40.0; 2], ..limits };
    let quick = Trajectory::through_corners(&corner, &limits, 0.1, &|_, _| true).unwrap();
    lawful(&quick, &limits);
    assert!(quick.duration() < slow.duration());
    let wrong = Limits { jerk: vec![0.0; 2], ..limits };
    assert!(Trajectory::through_corners(&corner, &wrong, 0.1, &|_, _| true).is_err());
}

/// One joint over 1 rad at v = 1, a = 2: a trapezium takes d/v + v/a = 1.5 s, plus a rise of 0.05 s.
#[test]
fn a_straight_move_takes_the_time_of_its_trapezium() {
    let limits = Limits::new(vec![1.0], vec![2.0]);
    let straight = [vec![0.0], vec![1.0]];
    let trajectory = Trajectory::through_corners(&straight, &limits, 0.1, &|_, _| true).unwrap();
    assert!((trajectory.duration() - 1.55).abs() < 0.01, "{}", trajectory.duration());
    let middle = trajectory.sample(trajectory.duration() / 2.0);
    assert!((middle.q[0] - 0.5).abs() < 1e-6 && (middle.dq[0] - 1.0).abs() < 0.01);
    let slow = trajectory.clone().slowed(2.0);
    assert!((slow.duration() - 2.0 * trajectory.duration()).abs() < 1e-12);
    let (speed, acceleration) = slow.worst(&limits, 1e-3);
    assert!((speed - 0.5).abs() < 0.01 && (acceleration - 0.25).abs() < 0.01);
}

#[test]
fn a_corner_that_must_not_be_cut_is_stopped_at() {
    let limits = Limits::new(vec![1.0; 2], vec![2.0; 2]);
    let corner = [vec![0.0, 0.0], vec![1.0, 0.0], vec![1.0, 1.0]];
    // Only the edges themselves are free.
    let on_edge = |q: &[f64]| q[1].abs() < 1e-9 || (q[0] - 1.0).abs() < 1e-9;
    let free = |a: &[f64], b: &[f64]| on_edge(a) && on_edge(b);
    let trajectory = Trajectory::through_corners(&corner, &limits, 0.3, &free).unwrap();
    lawful(&trajectory, &limits);
    for k in 0..=1000 {
        assert!(on_edge(&trajectory.sample(trajectory.duration() * f64::from(k) / 1000.0).q));
    }
    let free = Trajectory::through_corners(&corner, &limits, 0.3, &|_, _| true).unwrap();
    lawful(&free, &limits);
    assert!(free.duration() < trajectory.duration() - 0.2);
}

#[test]
fn dense_points_are_passed_and_pieces_join() {
    let limits = Limits::new(vec![1.0; 2], vec![3.0; 2]);
    let arc: Vec<Vec<f64>> =
        (0..=100).map(|k| f64::from(k) * 0.015).map(|a| vec![a.sin(), 1.0 - a.cos()]).collect();
    let trajectory = Trajectory::through_points(&arc, &limits).unwrap();
    lawful(&trajectory, &limits);
    for k in 0..=200 {
        let q = trajectory.sample(trajectory.duration() * f64::from(k) / 200.0).q;
        // On the unit circle about (0, 1) throughout, not only at the points.
        assert!((q[0].hypot(q[1] - 1.0) - 1.0).abs() < 1e-6);
    }
    let end = arc.last().unwrap().clone();
    let back =
        Trajectory::through_corners(&[end, vec![0.0, 0.0]], &limits, 0.1, &|_, _| true).unwrap();
    let whole = trajectory.clone().then(&back).unwrap();
    lawful(&whole, &limits);
    assert!((whole.duration() - trajectory.duration() - back.duration()).abs() < 1e-12);
    assert!(matches!(back.clone().then(&back), Err(Error::Trajectory { .. })));
}

#[test]
fn a_motion_given_in_time_passes_its_points_when_it_should() {
    let times = [0.0, 0.5, 1.0, 2.0];
    let points = [vec![0.0], vec![0.2], vec![0.5], vec![0.4]];
    let trajectory = Trajectory::from_points(&times, &points).unwrap();
    for (t, point) in times.iter().zip(&points) {
        assert!((trajectory.sample(*t).q[0] - point[0]).abs() < 1e-12);
    }
    assert!(Trajectory::from_points(&[0.0, 0.0], &points[..2]).is_err());
    assert!(Trajectory::from_points(&times, &points[..2]).is_err());
    let limits = Limits::new(vec![1.0], vec![1.0]);
    assert!(Trajectory::through_points(&[], &limits).is_err());
    let still = Trajectory::through_corners(&[vec![0.3]], &limits, 0.1, &|_, _| true).unwrap();
    assert_eq!(still.sample(0.0).q, vec![0.3]);
}
