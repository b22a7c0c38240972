//! Answers that cannot be are refused with what is wrong, and the arm is asked to stop.

use serde_json::{Value, json};
use trueup::arm::{Arm as _, Camera as _, Cancel, DeviceError, Scales as _};
use trueup::bridge::{self, Bridged, Error, Joint, Wanted};

use super::reality::serve;

const JOINTS: [&str; 2] = ["a", "b"];

/// Connects to a robot with these joints, each from -3 to 3 rad and of 39 N·m, and fingers of 85 mm.
pub(super) fn connect(place: &str, robot: &str, joints: &[&str]) -> Result<Bridged, Error> {
    bridge::connect(place, wanted(robot, joints), Cancel::default())
}

pub(super) fn wanted(robot: &str, joints: &[&str]) -> Wanted {
    let joint = |name: &&str| Joint {
        name: (*name).to_owned(),
        range: (-3.0, 3.0),
        effort: 39.0,
        velocity: 1.4,
        acceleration: 4.94,
        jerk: 98.8,
    };
    let joints = joints.iter().map(joint).collect();
    Wanted { robot: robot.to_owned(), joints, max_opening: 0.085 }
}

fn word(request: &Value) -> String {
    request.as_object().unwrap().keys().next().unwrap().clone()
}

fn hello() -> String {
    json!({"hello": 1, "name": "test", "joints": JOINTS, "scales": true, "realtime": false,
           "camera": {"width": 2, "height": 1}})
    .to_string()
}

fn told(t: f64) -> String {
    json!({"t": t, "q": [0.0, 0.1], "dq": [0.0, 0.0], "tau": [0.0, 0.0], "opening": 0.08})
        .to_string()
}

/// Feedback with two balls that move, `hand` and another.
fn moving(name: &str, radius: f64) -> String {
    let ball = |name: &str, radius: f64| json!({"name": name, "at": [0.5, 0.1, 0.3], "radius": radius, "age": 0.04});
    let mut told: Value = serde_json::from_str(&told(6.0)).unwrap();
    told["moving"] = json!([ball("hand", 0.1), ball(name, radius)]);
    told.to_string()
}

#[test]
fn what_moves_by_itself_is_told_with_the_feedback() {
    let mut count = 0;
    let (place, _) = serve(move |_| {
        count += 1;
        Some(if count == 1 { hello() } else { moving("head", 0.2) })
    });
    let mut arm = connect(&place, "robot", &JOINTS).unwrap().arm;
    let told = arm.feedback().unwrap().moving;
    assert_eq!(told.len(), 2);
    let head = &told[1];
    assert_eq!((head.name.as_str(), head.radius, head.age), ("head", 0.2, 0.04));
    assert!((head.at - nalgebra::Vector3::new(0.5, 0.1, 0.3)).norm() < 1e-12);
}

#[test]
fn a_server_may_begin_with_a_byte_order_mark() {
    let mut count = 0;
    let (place, _) = serve(move |_| {
        count += 1;
        Some(if count == 1 { format!("\u{feff}{}\r", hello()) } else { told(5.0) })
    });
    connect(&place, "robot", &JOINTS).unwrap();
}

/// What goes wrong when hello and the first feedback are well and every later request is answered with this;
/// and what was asked in all.
fn after_a_good_beginning(bad: impl Into<String>) -> (DeviceError, Vec<String>) {
    let bad = bad.into();
    let mut count = 0;
    let (place, asked) = serve(move |request| {
        count += 1;
        Some(match (count, word(request).as_str()) {
            (1, _) => hello(),
            (2, _) => told(5.0),
            (_, "stop") => told(9.0),
            _ => bad.clone(),
        })
    });
    let mut arm = connect(&place, "robot", &JOINTS).unwrap().arm;
    let error = arm.wait(0.1, &Cancel::default(), &mut |_| {}).unwrap_err();
    // What was wrong once is not asked again.
    let again = arm.wait(0.1, &Cancel::default(), &mut |_| {}).unwrap_err();
    if !error.to_string().contains("refused") {
        assert_eq!(error, again);
    }
    // The server reads in its own time, on a busy machine after the client has gone on.
    for _ in 0..2000 {
        let words: Vec<String> = asked.lock().unwrap().iter().map(word).collect();
        if words.iter().any(|word| word == "stop") {
            return (error, words);
        }
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    panic!("no stop was asked for: {error}");
}

#[test]
fn every_answer_that_cannot_be_is_named_and_stops_the_arm() {
    let nan = told(6.0).replace("0.1", "NaN");
    let short = json!({"t": 6.0, "q": [0.0], "dq": [0.0, 0.0], "tau": [0.0, 0.0], "opening": 0.08});
    let table = [
        (short.to_string(), "`q` in the answer to `step` has 1 numbers; the robot has 2 joints"),
        (nan, "`q` of joint 2 in the answer to `step` is no finite number"),
        (
            told(6.0).replace(r#""tau":[0.0"#, r#""tau":[-Infinity"#),
            "`tau` of joint 1 in the answer to `step` is no finite number",
        ),
        (
            told(6.0).replace("0.08", "null"),
            "`opening` in the answer to `step` is no finite number",
        ),
        (told(6.0).replace("0.1", "1e999"), "the answer to `step` cannot be read"),
        (
            told(6.0).replace("0.1", "55.0"),
            "`q` of joint 2 in the answer to `step` is 55.00, far outside -3.00 to 3.00: probably in degrees",
        ),
        (told(6.0).replace("0.1", "1e4"), "is 10000.00, far outside -3.00 to 3.00"),
        // A pour weighed 466.6 kg in the hand, and 67 L in the cup.
        (
            told(6.0).replace(r#""tau":[0.0"#, r#""tau":[-12400.0"#),
            "`tau` of joint 1 in the answer to `step` is -12400.00, far outside -39.00 to 39.00: probably in mN*m or N*mm",
        ),
        (
            told(6.0).replace("0.08", "80.0"),
            "`opening` in the answer to `step` is 80.00, far outside",
        ),
        // Fingers 50 mm less open than closed were taken for closed ones, and a plan for one that nobody could carry out.
        (
            told(6.0).replace("0.08", "-0.05"),
            "`opening` in the answer to `step` is -50 mm: a gripper cannot open by less than 0",
        ),
        (told(6.0).replace("0.08", "-0.006"), "is -6 mm: a gripper cannot open by less than 0"),
        (
            told(6.0).replace("0.08", "-80.0"),
            "`opening` in the answer to `step` is -80.00, far outside",
        ),
        (told(9.0), "the bridge's clock went on by 4.000 s, though 0.004 s were to pass"),
        (told(4.0), "the bridge's clock went back from 5.000000 s to 4.000000 s"),
        (moving("head", 0.0), "number 2 of `moving` in the answer to `step` is no ball"),
        (moving("head", 2.1), "number 2 of `moving` in the answer to `step` is no ball"),
        (
            moving("hand", 0.2),
            "number 2 of `moving` in the answer to `step` is no ball with a name of its own",
        ),
        // A list of the values, in order, was read as feedback.
        (
            json!([6.0, [0.0, 0.1], [0.0, 0.0], [0.0, 0.0], 0.08]).to_string(),
            "the answer to `step` is a list: the protocol has one object there",
        ),
        (
            moving("head", 0.2)
                .replace(r#""moving":["#, r#""moving":[["head",[0.5,0.1,0.3],0.1,0.04],"#),
            "expected an object",
        ),
        (
            r#"{"t": 6.0, "q": [0.0,"#.into(),
            r#"the answer to `step` ends too early: it begins `{"t": 6.0, "q": [0.0,`"#,
        ),
        (String::new(), "the answer to `step` ends too early: it is an empty line"),
        (told(6.0).replace("0.08", r#""wide""#), ", in `opening`; it begins `{"),
        ("hello?".into(), "the answer to `step` cannot be read"),
        ("{}".into(), "the answer to `step` cannot be read: missing field `t`"),
        ("x".repeat((16 << 20) + (1 << 17)), "is longer than 16 MiB"),
    ];
    for (bad, what) in table {
        let (error, asked) = after_a_good_beginning(bad);
        assert!(error.to_string().contains(what), "{error}");
        assert!(!error.help().is_empty());
        assert_eq!(asked, ["hello", "feedback", "step", "stop"], "{what}");
    }
}

/// 1.00 was said to be "probably in mm".
#[test]
fn an_opening_in_another_unit_is_told_in_which() {
    for (opening, unit) in [
        ("1.0", "fractions of its widest (0 to 1)"),
        ("0.4", "fractions of its widest (0 to 1)"),
        ("85.0", "mm"),
        ("30.0", "mm"),
        ("100.0", "per cent of its widest"),
        ("255.0", "a gripper's counts (0 to 255)"),
        ("200.0", "a gripper's counts (0 to 255)"),
    ] {
        let (error, _) = after_a_good_beginning(told(6.0).replace("0.08", opening));
        let what = error.to_string();
        assert!(what.ends_with(&format!("to 0.09: probably in {unit}")), "{what}");
        assert!(error.help().contains("between the pads, in m"), "{}", error.help());
    }
    let (error, _) = after_a_good_beginning(told(6.0).replace("0.08", "4000.0"));
    assert!(error.to_string().ends_with("is 4000.00, far outside 0.00 to 0.09"), "{error}");
}

/// A spike in mid-motion was told as another unit, for which the URDF was to be mended.
#[test]
fn a_torque_that_leaps_after_good_ones_is_a_knock() {
    let mut count = 0;
    let (place, _) = serve(move |_| {
        count += 1;
        let tau = if count < 12 { "3.5" } else { "-2948.0" };
        let tau = format!(r#""tau":[{tau}"#);
        let told = told(0.004 * f64::from(count)).replace(r#""tau":[0.0"#, &tau);
        Some(if count == 1 { hello() } else { told })
    });
    let mut arm = connect(&place, "robot", &JOINTS).unwrap().arm;
    let error = arm.wait(0.1, &Cancel::default(), &mut |_| {}).unwrap_err();
    let said = "`tau` of joint 1 in the answer to `step` is -2948 after 3.5, where 39 is the most: the joint felt a knock, or the simulation has diverged";
    assert_eq!(error.to_string(), said);
    assert!(!error.help().contains("URDF"), "{}", error.help());
}

/// Two cameras were told as a map that is no u32, and a size without keys was taken.
#[test]
fn a_camera_is_one_object() {
    let size = json!({"width": 2, "height": 1});
    for list in [json!([size, size]), json!([size]), json!([2, 1])] {
        let mut said: Value = serde_json::from_str(&hello()).unwrap();
        said["camera"] = list;
        let (place, _) = serve(move |_| Some(said.to_string()));
        let error = connect(&place, "robot", &JOINTS).err().unwrap();
        let said = "`camera` in the answer to `hello` is a list: the protocol has one object there";
        assert_eq!(error.to_string(), said);
        assert!(error.help().contains("--camera-at"), "{}", error.help());
    }
}

/// An encoder's zero is off by a little.
#[test]
fn fingers_may_be_told_a_little_less_than_closed() {
    let mut count = 0;
    let (place, _) = serve(move |_| {
        count += 1;
        let closed = |t: f64| told(t).replace("0.08", "-0.002");
        Some(if count == 1 { hello() } else { closed(5.0 + 0.004 * f64::from(count)) })
    });
    let mut arm = connect(&place, "robot", &JOINTS).unwrap().arm;
    arm.wait(0.1, &Cancel::default(), &mut |_| {}).unwrap();
}

/// A frozen encoder let a run go through fourteen steps; a clock that stood was never noticed.
#[test]
fn joints_that_do_not_follow_and_a_clock_that_stands_stop_the_arm() {
    let after = |wrong: fn(f64) -> String| {
        let mut count = 0;
        let (place, asked) = serve(move |request| {
            count += 1;
            Some(match (count, word(request).as_str()) {
                (1, _) => hello(),
                (2, _) => told(0.0),
                _ => wrong(0.004 * f64::from(count - 2)),
            })
        });
        let mut arm = connect(&place, "robot", &JOINTS).unwrap().arm;
        let error = arm.wait(2.0, &Cancel::default(), &mut |_| {}).unwrap_err();
        let steps = asked.lock().unwrap().iter().filter(|asked| word(asked) == "step").count();
        (error, steps)
    };
    let (error, steps) = after(|t| told(t).replace("[0.0,0.1]", "[0.0,0.4]"));
    let DeviceError::FollowingError { joint: 2, error_deg, .. } = error else {
        panic!("{error:?}")
    };
    assert!((error_deg - 0.3_f64.to_degrees()).abs() < 1e-9, "{error_deg}");
    // Half a second, and what the arm is given to come to rest in.
    assert!((125..260).contains(&steps), "{steps}");
    let (error, steps) = after(|_| told(0.5));
    assert!(error.to_string().contains("stands still at 0.500000 s"), "{error}");
    assert!((250..260).contains(&steps), "{steps}");
    // A whole turn is no distance.
    let mut count = 0;
    let (place, _) = serve(move |_| {
        count += 1;
        let turned = format!("[0.0,{}]", 0.1 + std::f64::consts::TAU);
        let told = |t: f64| told(t).replace("[0.0,0.1]", &turned);
        Some(match count {
            1 => hello(),
            2 => super::answers::told(0.0),
            _ => told(0.004 * f64::from(count - 2)),
        })
    });
    let mut arm = connect(&place, "robot", &JOINTS).unwrap().arm;
    arm.wait(1.0, &Cancel::default(), &mut |_| {}).unwrap();
}

#[test]
fn what_the_server_says_would_help_is_what_is_said() {
    let refusal = json!({"error": "joint 2 is in fault", "help": "clear it", "code": 7});
    let (error, asked) = after_a_good_beginning(refusal.to_string());
    assert_eq!(error.to_string(), "the bridge refused `step`: joint 2 is in fault");
    assert_eq!(error.help(), "clear it");
    assert_eq!(asked[..4], ["hello", "feedback", "step", "stop"]);
}

#[test]
fn a_server_that_hangs_up_or_is_another_is_told_apart() {
    let (place, _) = serve(|_| None);
    let closed = connect(&place, "robot", &JOINTS).err().unwrap();
    assert_eq!(closed, Error::Closed { request: "hello" });
    // A server that builds its world for its first client was taken for one that another client holds.
    let late = Error::Silent { request: "hello", within_s: 10.0 };
    assert_eq!(late.to_string(), "the bridge did not answer `hello` within 10 s");
    assert!(late.help().contains("build its world") && late.help().contains("try again"));
    let (place, _) = serve(|_| Some(hello().replace(r#""hello":1"#, r#""hello":2"#)));
    let version = connect(&place, "robot", &JOINTS).err().unwrap();
    assert_eq!(version, Error::Version { theirs: 2, ours: 1 });
    let (place, _) = serve(|_| Some(hello()));
    let joints = connect(&place, "robot", &["b", "a"]).err().unwrap();
    assert!(matches!(joints, Error::Joints { .. }), "{joints}");
    assert_eq!(joints.to_string(), "the bridge has the joints a, b; the scene's robot has b, a");
    // Port 1 of this machine: nobody.
    let nobody = connect("127.0.0.1:1", "robot", &JOINTS).err().unwrap();
    assert!(matches!(&nobody, Error::Nobody { .. }), "{nobody}");
}

/// Its picture was of one instant and every later feedback of the one before, and nobody noticed.
#[test]
fn an_answer_that_nobody_asked_for_is_refused() {
    let (error, _) = after_a_good_beginning(format!("{}\n{}", told(5.1), told(5.1)));
    let said = error.to_string();
    assert_eq!(said, "after its answer to `step` the bridge sent another that nobody asked for");
}

/// A picture that took 20 s held up Ctrl-C for as long.
#[test]
fn a_wish_to_stop_does_not_wait_for_an_answer() {
    let cancel = Cancel::default();
    let (free, held) = std::sync::mpsc::channel();
    let (wish, mut count) = (cancel.clone(), 0);
    let (place, asked) = serve(move |request| {
        count += 1;
        Some(match (count, word(request).as_str()) {
            (1, _) => hello(),
            (3, _) => {
                wish.cancel();
                held.recv().unwrap();
                told(0.1)
            }
            _ => told(0.1 * f64::from(count)),
        })
    });
    let wanted = wanted("robot", &JOINTS);
    let mut arm = bridge::connect(&place, wanted, cancel.clone()).unwrap().arm;
    let stopped = arm.wait(0.1, &cancel, &mut |_| {});
    assert_eq!(stopped, Err(DeviceError::Stopped));
    // The stop was sent, and nobody knows yet that the arm holds.
    assert!(arm.owes_stop());
    // What was not waited for comes before the next answer, and is not taken for it.
    cancel.clear();
    free.send(()).unwrap();
    let here = arm.feedback().unwrap();
    assert!((here.time - 0.3).abs() < 1e-9, "{here:?}");
    let asked: Vec<String> = asked.lock().unwrap().iter().map(word).collect();
    assert_eq!(asked, ["hello", "feedback", "step", "stop", "feedback"]);
    assert!(!arm.is_lost() && !arm.owes_stop());
}

/// The prompt said that lines move the arm again, over a connection that was lost.
#[test]
fn a_lost_connection_says_so_and_a_new_one_is_well() {
    let mut count = 0;
    let (place, _) = serve(move |request| {
        count += 1;
        match (count, word(request).as_str()) {
            (3, _) => None,
            (_, "hello") => Some(hello()),
            _ => Some(told(0.1 * f64::from(count))),
        }
    });
    let mut arm = connect(&place, "robot", &JOINTS).unwrap().arm;
    assert!(!arm.is_lost());
    let lost = arm.wait(0.1, &Cancel::default(), &mut |_| {}).unwrap_err();
    assert!(lost.to_string().contains("closed the connection"), "{lost}");
    assert!(arm.is_lost());
    drop(arm);
    let mut arm = connect(&place, "robot", &JOINTS).unwrap().arm;
    arm.wait(0.01, &Cancel::default(), &mut |_| {}).unwrap();
    assert!(!arm.is_lost());
}

#[test]
fn pictures_and_scales_come_over_the_same_line() {
    let mut png = std::io::Cursor::new(Vec::new());
    let picture = image::RgbImage::from_pixel(2, 1, image::Rgb([9, 8, 7]));
    picture.write_to(&mut png, image::ImageFormat::Png).unwrap();
    let png = {
        use base64::Engine as _;
        base64::engine::general_purpose::STANDARD.encode(png.into_inner())
    };
    let (place, asked) = serve(move |request| {
        Some(match word(request).as_str() {
            "hello" => hello(),
            "photo" => json!({"png": png}).to_string(),
            "scales" => json!({"water": [["cup", 1e-4]], "spilt": 2e-6}).to_string(),
            _ => told(0.0),
        })
    });
    let bridged = connect(&place, "robot", &JOINTS).unwrap();
    assert_eq!(bridged.camera.unwrap().photo().unwrap(), picture);
    let read = bridged.scales.unwrap().weigh().unwrap();
    assert_eq!((read.water, read.spilt), (vec![("cup".to_owned(), 1e-4)], 2e-6));
    assert_eq!(asked.lock().unwrap()[0], json!({"hello": {"version": 1, "robot": "robot"}}));
}

/// It was told to look after the table and its dots, as if the picture had been used.
#[test]
fn a_picture_of_another_size_than_said_is_the_server_s_mistake() {
    let mut png = std::io::Cursor::new(Vec::new());
    image::RgbImage::new(4, 3).write_to(&mut png, image::ImageFormat::Png).unwrap();
    let png = {
        use base64::Engine as _;
        base64::engine::general_purpose::STANDARD.encode(png.into_inner())
    };
    let (place, _) = serve(move |request| {
        Some(match word(request).as_str() {
            "hello" => hello(),
            "photo" => json!({"png": png}).to_string(),
            _ => told(0.0),
        })
    });
    let error = connect(&place, "robot", &JOINTS).unwrap().camera.unwrap().photo().unwrap_err();
    assert_eq!(error.to_string(), "the bridge's picture has 4 x 3 px, its `hello` says 2 x 1 px");
    assert!(error.help().contains("the size that `hello` says"), "{}", error.help());
}
