//! The JSON answers of `robot fk | ik | dynamics | plan`.

use serde_json::{Value, json, to_value};
use trueup::cli::answer::plan::plan;
use trueup::cli::answer::problem::Problem;
use trueup::cli::answer::robot::{dynamics, fk, ik};
use trueup::cli::answer::rows::{joint_rows, pose_rows};
use trueup::motion::dynamics::Bodies;
use trueup::motion::free::Means;
use trueup::motion::rrt::Settings;
use trueup::motion::{Budget, Error, Robot};

/// A clock that goes on by 5 µs whenever it is read.
fn clock() -> impl FnMut() -> f64 {
    let mut now = 0.0;
    move || {
        now += 5.0;
        now
    }
}

#[test]
fn rows_are_read_with_and_without_a_header() {
    let robot = Robot::gen3();
    let bare = joint_rows(&robot, "0,0,0,0,0,0,0\n\n1,2,3,4,5,6,7\n").unwrap();
    assert_eq!(bare.len(), 2);
    let named =
        joint_rows(&robot, "name,q_1[rad],q2,q3,q4,q5,q6,q7\nhome,1,2,3,4,5,6,7\n").unwrap();
    assert_eq!(named, vec![vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]]);
    let degrees = "q_1[deg],q_2[deg],q_3[deg],q_4[deg],q_5[deg],q_6[deg],q_7\n180,90,0,0,0,0,1\n";
    let turned = joint_rows(&robot, degrees).unwrap().remove(0);
    assert!(
        (turned[0] - std::f64::consts::PI).abs() < 1e-15 && (turned[6] - 1.0).abs() < 1e-15,
        "{turned:?}"
    );
    let poses = pose_rows("x[mm],y[mm],z[m],qw,qx,qy,qz\n400,0,0.3,1,0,0,0").unwrap();
    assert!((poses[0].origin().x - 0.4).abs() < 1e-15);
    let reference = joint_rows(&robot, include_str!("../motion/reference.csv")).unwrap();
    assert_eq!(reference.len(), 5);
    for (text, part) in [
        ("1,2,3", "3 numbers where 7"),
        ("1,2,3,4,x,6,7", "line 1"),
        ("q1,q2\n1,2", "header needs"),
        ("q_1[turns],q2,q3,q4,q5,q6,q7\n1,2,3,4,5,6,7", "turns"),
        ("", "no numbers"),
    ] {
        let error = joint_rows(&robot, text).unwrap_err().to_string();
        assert!(error.contains(part), "{error}");
    }
    assert_eq!(pose_rows("x,y,z,qw,qx,qy,qz\n0.4,0,0.3,1,0,0,0").unwrap().len(), 1);
    assert!(pose_rows("0.4,0,0.3,0,0,0,0").unwrap_err().to_string().contains("length 0.0000"));
}

#[test]
fn fk_ik_and_dynamics_answer_as_the_interface_says() {
    let robot = Robot::gen3();
    let home = robot.pose("home").unwrap().to_vec();
    let answer = to_value(fk(&robot, std::slice::from_ref(&home)).unwrap()).unwrap();
    assert_eq!(answer["poses"][0]["tip"], "end_effector_link");
    assert!((answer["poses"][0]["xyz_m"][2].as_f64().unwrap() - 0.433_724_314_027).abs() < 1e-11);
    assert_eq!(answer["poses"][0]["quat_wxyz"].as_array().unwrap().len(), 4);

    let pose = robot.forward(&home).unwrap();
    let far = pose_rows("3,0,0,1,0,0,0").unwrap()[0];
    let answer = to_value(ik(&robot, &[pose, far], &home, 0, &mut clock())).unwrap();
    let first = &answer["solutions"][0];
    assert_eq!(first["found"], true);
    assert!(first["position_error_m"].as_f64().unwrap() < 1e-9);
    assert!((first["time_us"].as_f64().unwrap() - 5.0).abs() < 1e-9);
    let second = &answer["solutions"][1];
    assert_eq!(
        (second["found"].clone(), second["reason"].clone()),
        (json!(false), json!("out_of_reach"))
    );
    assert!(second["nearest_m"].as_f64().unwrap() > 1.5);

    let answer = to_value(dynamics(&robot, Bodies::UpToTip, &[home]).unwrap()).unwrap();
    let row = &answer["rows"][0];
    assert!((row["gravity_nm"][1].as_f64().unwrap() + 8.729_415).abs() < 1e-6);
    assert_eq!(row["mass_matrix"].as_array().unwrap().len(), 7);
}

fn problem() -> Value {
    json!({
        "start": [-0.6, 0.26, 3.1, -2.27, 0.0, 0.96, 1.57],
        "goals": [[0.6, 0.26, 3.1, -2.27, 0.0, 0.96, 1.57]],
        "obstacles": [
            {"shape": "box", "size_m": [0.5, 0.02, 0.5],
             "pose": {"xyz_m": [0.55, 0.0, 0.3], "quat_wxyz": [1, 0, 0, 0]}},
            {"shape": "cylinder", "size_m": [0.03, 0.3],
             "pose": {"xyz_m": [0.3, 0.5, 0.15], "quat_wxyz": [1, 0, 0, 0]}},
            {"shape": "sphere", "size_m": [0.05],
             "pose": {"xyz_m": [-0.4, 0.0, 0.5], "quat_wxyz": [1, 0, 0, 0]}},
        ],
    })
}

#[test]
fn a_plan_is_timed_inside_the_limits_and_free_all_the_way() {
    let robot = Robot::gen3();
    let problem = Problem::parse(&problem().to_string()).unwrap();
    let run = Budget::new(|| false);
    let answer =
        plan(&robot, &problem, Means::default(), &Settings::default(), &run, &mut clock()).unwrap();
    let answer = to_value(answer).unwrap();
    assert_eq!(answer["found"], true);
    let rows = |value: &Value| -> Vec<Vec<f64>> { serde_json::from_value(value.clone()).unwrap() };
    let path = rows(&answer["path_rad"]);
    let times: Vec<f64> = serde_json::from_value(answer["time_s"].clone()).unwrap();
    assert_eq!(path.len(), times.len());
    assert!(times.windows(2).all(|t| t[1] >= t[0]));
    let q = rows(&answer["trajectory"]["q_rad"]);
    let t: Vec<f64> = serde_json::from_value(answer["trajectory"]["t_s"].clone()).unwrap();
    assert_eq!(q[0], problem.start);
    assert_eq!(q.last().unwrap(), path.last().unwrap());
    let world = problem.world(&robot).unwrap();
    for k in 0..q.len() {
        assert!(world.free(&q[k]));
        if k > 0 {
            for (i, joint) in robot.joints().iter().enumerate() {
                let speed = (q[k][i] - q[k - 1][i]).abs() / (t[k] - t[k - 1]);
                assert!(speed <= joint.velocity * 1.000_001);
            }
        }
    }
    assert!(answer["min_clearance_m"].as_f64().unwrap() > 0.0);
}

#[test]
fn a_problem_that_cannot_be_solved_or_read_says_why() {
    let robot = Robot::gen3();
    let run = Budget::new(|| false);
    let mut blocked = problem();
    blocked["obstacles"][0]["pose"]["xyz_m"] = json!([0.45, -0.3, 0.4]);
    let blocked = Problem::parse(&blocked.to_string()).unwrap();
    let answer =
        plan(&robot, &blocked, Means::default(), &Settings::default(), &run, &mut clock()).unwrap();
    let answer = to_value(answer).unwrap();
    assert_eq!(answer["found"], false);
    assert!(answer["reason"].as_str().unwrap().contains("goal is in collision"), "{answer}");
    // Which of several goals it is that is beyond a limit, and by how much.
    let mut beyond = problem();
    let goal = json!([0.6, 3.0, 3.1, -2.27, 0.0, 0.96, 1.57]);
    beyond["goals"] = json!([goal, goal]);
    let beyond = Problem::parse(&beyond.to_string()).unwrap();
    let answer =
        plan(&robot, &beyond, Means::default(), &Settings::default(), &run, &mut clock()).unwrap();
    let answer = to_value(answer).unwrap();
    let reason = answer["reason"].as_str().unwrap();
    assert!(reason.starts_with("goal 2 of 2 has joint_2 at 3.0000, 0."), "{reason}");
    assert!(reason.contains(" rad outside its range "), "{reason}");
    assert!(answer.get("help").is_none(), "{answer}");
    // A margin is kept all the way, and one that cannot be is told.
    let mut wide = problem();
    wide["margin_m"] = json!(0.03);
    let kept = Problem::parse(&wide.to_string()).unwrap();
    let kept =
        plan(&robot, &kept, Means::default(), &Settings::default(), &run, &mut clock()).unwrap();
    assert!(to_value(kept).unwrap()["min_clearance_m"].as_f64().unwrap() >= 0.03);
    wide["margin_m"] = json!(0.3);
    let wide = Problem::parse(&wide.to_string()).unwrap();
    let answer =
        plan(&robot, &wide, Means::default(), &Settings::default(), &run, &mut clock()).unwrap();
    assert_eq!(to_value(answer).unwrap()["found"], false);
    let mut wrong = problem();
    wrong["margin_m"] = json!(-0.01);
    let wrong = Problem::parse(&wrong.to_string()).unwrap();
    assert!(matches!(wrong.world(&robot), Err(Error::Input { .. })));
    let mut wrong = problem();
    wrong["obstacles"][1]["size_m"] = json!([0.1]);
    let wrong = Problem::parse(&wrong.to_string()).unwrap();
    assert!(matches!(wrong.world(&robot), Err(Error::Input { .. })));
    assert!(Problem::parse("{\"start\": 3}").unwrap_err().to_string().contains("line 1"));
}

/// `held`, `walls` and `speed` were passed over without a word, and the path led through them.
#[test]
fn a_key_of_a_problem_that_is_not_read_is_refused_and_a_label_is_not() {
    let said = |change: &dyn Fn(&mut Value)| {
        let mut changed = problem();
        change(&mut changed);
        Problem::parse(&changed.to_string()).map(|_| ()).map_err(|error| error.to_string())
    };
    for key in ["held", "attached", "walls", "objects", "world", "speed", "joints"] {
        let told = said(&|problem| problem[key] = json!([])).unwrap_err();
        let end = format!("unknown key `{key}`; known: start, goals, obstacles, margin_m");
        assert!(told.ends_with(&end), "{told}");
    }
    let told = said(&|problem| problem["margin"] = json!(0.1)).unwrap_err();
    assert!(told.ends_with("unknown key `margin`; did you mean `margin_m`?"), "{told}");
    // What is there is not what was meant.
    let told = said(&|problem| problem["obstacle"] = json!([])).unwrap_err();
    assert!(told.ends_with("margin_m"), "{told}");
    let told = said(&|problem| problem["obstacles"][1]["velocity_m_s"] = json!(1)).unwrap_err();
    assert!(told.contains("obstacle cylinder 2: unknown key `velocity_m_s`; known: "), "{told}");
    let told = said(&|problem| {
        problem["obstacles"][0]["name"] = json!("door");
        problem["obstacles"][0]["pose"]["rpy_deg"] = json!([0, 0, 90]);
    });
    let told = told.unwrap_err();
    assert!(told.contains("obstacle door: pose: unknown key `rpy_deg`; known: xyz_m"), "{told}");
    let labelled = said(&|problem| {
        for key in ["name", "index", "comment", "description"] {
            problem[key] = json!(3);
        }
        problem["obstacles"][0]["index"] = json!(1);
        problem["obstacles"][0]["comment"] = json!("as measured");
    });
    assert_eq!(labelled, Ok(()));
}

/// `robot plan` made [2, 0, 0, 0] and [1, 1, 0, 0] as long as they should be without a word, and `robot ik` refused them.
#[test]
fn a_quaternion_is_of_length_1_in_a_problem_as_in_a_pose() {
    for (turn, length) in [
        ([2.0, 0.0, 0.0, 0.0], Some("2.0000")),
        ([1.0, 1.0, 0.0, 0.0], Some("1.4142")),
        ([0.0; 4], Some("0.0000")),
        // Rounded to two decimals.
        ([0.27, 0.65, 0.65, 0.27], None),
        ([-0.5, 0.5, -0.5, 0.5], None),
    ] {
        let mut turned = problem();
        turned["obstacles"][2]["pose"]["quat_wxyz"] = json!(turn);
        let planned = Problem::parse(&turned.to_string()).map(|_| ());
        let [w, x, y, z] = turn;
        let posed = pose_rows(&format!("0.5,0,0.3,{w},{x},{y},{z}")).map(|_| ());
        let Some(length) = length else {
            assert_eq!((planned, posed), (Ok(()), Ok(())), "{turn:?}");
            continue;
        };
        let end = format!(" has length {length}, not 1");
        let [planned, posed] = [planned, posed].map(|said| said.unwrap_err().to_string());
        assert!(planned.contains("obstacle sphere 3: the quaternion quat_wxyz"), "{planned}");
        assert!(planned.ends_with(&end) && posed.ends_with(&end), "{planned} {posed}");
    }
}

/// Whatever numbers a problem holds, it is answered or refused in one sentence.
#[test]
fn a_problem_with_bad_numbers_is_refused_and_never_panics() {
    let robot = Robot::gen3();
    let ask = |problem: &Value| -> Result<Value, Error> {
        let problem = Problem::parse(&problem.to_string())?;
        let budget = Budget::of(20_000_000, || false);
        plan(&robot, &problem, Means::default(), &Settings::default(), &budget, &mut clock())
            .map(|answer| to_value(answer).unwrap())
    };
    let home = problem()["start"].clone();
    let with = |key: &str, value: Value| {
        let mut changed = problem();
        changed[key] = value;
        changed
    };
    let joint = |value: f64| {
        let mut q = home.clone();
        q[0] = json!(value);
        q
    };
    let boxed = |size: Value, at: Value, turn: Value| {
        with(
            "obstacles",
            json!([{"shape": "box", "size_m": size, "pose": {"xyz_m": at, "quat_wxyz": turn}}]),
        )
    };
    let (side, here, plain) = (json!([0.1, 0.1, 0.1]), json!([0.5, 0.0, 0.3]), json!([1, 0, 0, 0]));
    let refused = [
        with("start", json!([])),
        with("start", json!([0.0, 0.0])),
        with("start", joint(1e300)),
        with("start", joint(-1e8)),
        with("goals", json!([])),
        with("goals", json!([[]])),
        with("goals", json!([joint(1e300)])),
        with("goals", json!([home, joint(f64::MAX)])),
        with("goals", json!(vec![home.clone(); 10_001])),
        with("obstacles", json!(vec![problem()["obstacles"][2].clone(); 10_001])),
        boxed(json!([1e300, 1e300, 1e300]), here.clone(), plain.clone()),
        boxed(json!([0.1, -0.1, 0.1]), here.clone(), plain.clone()),
        boxed(json!([0.1, 0.0, 0.1]), here.clone(), plain.clone()),
        boxed(json!([]), here.clone(), plain.clone()),
        boxed(json!([0.1]), here.clone(), plain.clone()),
        boxed(side.clone(), json!([1e300, 0.0, 0.0]), plain.clone()),
        boxed(side.clone(), here.clone(), json!([0, 0, 0, 0])),
        boxed(side.clone(), here.clone(), json!([1e300, 1e300, 0, 0])),
    ];
    for (number, problem) in refused.iter().enumerate() {
        let error = ask(problem).expect_err(&format!("problem {number}"));
        assert!(error.to_string().len() < 200, "{error}");
    }
    // No number of JSON is that large.
    assert!(Problem::parse(&problem().to_string().replace("0.26", "1e999")).is_err());
    let answered = [
        // Turned often, but the same place.
        with("start", joint(-0.6 + 100.0 * std::f64::consts::TAU)),
        // Out of range.
        with("goals", json!([[0.6, 3.0, 3.1, -2.27, 0.0, 0.96, 1.57]])),
        // Around everything.
        boxed(json!([1000.0, 1000.0, 1000.0]), here, plain.clone()),
        // The shortest sides, inside the arm.
        boxed(json!([1e-6, 1e-6, 1e-6]), json!([0.0, 0.0, 0.3]), plain),
        with("goals", json!(vec![home.clone(); 1000])),
    ];
    for problem in &answered {
        let answer = ask(problem).unwrap();
        assert!(answer["found"].is_boolean(), "{answer}");
    }
}

#[test]
fn joint_positions_and_poses_with_bad_numbers_are_refused() {
    let robot = Robot::gen3();
    for bad in ["nan", "inf", "-inf", "1e308", "1e6", "x", ""] {
        let row = format!("{bad},0.26,3.14,-2.27,0,0.96,1.57");
        let found = joint_rows(&robot, &row).and_then(|rows| {
            dynamics(&robot, Bodies::All, &rows)?;
            fk(&robot, &rows)
        });
        assert!(found.is_err(), "{row}");
        let pose = format!("{bad},0,0.3,1,0,0,0");
        assert!(pose_rows(&pose).is_err(), "{pose}");
        let turn = format!("0.5,0,0.3,{bad},0,0,0");
        assert!(pose_rows(&turn).is_err(), "{turn}");
    }
    assert!(pose_rows("0.5,0,0.3,0,0,0,0").is_err());
}
