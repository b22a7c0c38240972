//! Frames and messages, byte for byte against the vendor's own encoder, and laws of the codec.
//!
//! `golden.json`: requests are bytes of the official Python client 2.3.0; responses and notifications were
//! encoded with its message classes. None was captured from an arm.

use proptest::prelude::*;
use prost::Message;
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};
use serde_json::Value;
use trueup::kortex::degrees;
use trueup::kortex::frame::{Decoder, Frame, FrameError, Header, Kind, LONGEST, MAGIC};
use trueup::kortex::messages::{base, common, config, cyclic, motion, session, trajectory};
use trueup::kortex::refusal::{Refusal, SUB_CODES};
use trueup::kortex::rpc::{self, Rpc};

fn golden() -> Vec<Value> {
    serde_json::from_str(include_str!("golden.json")).unwrap()
}

fn bytes(vector: &Value, key: &str) -> Vec<u8> {
    let hex = vector[key].as_str().unwrap_or_default();
    (0..hex.len()).step_by(2).map(|at| u8::from_str_radix(&hex[at..at + 2], 16).unwrap()).collect()
}

fn number(vector: &Value, key: &str) -> u16 {
    vector[key].as_u64().unwrap_or(0) as u16
}

/// The frame a vector describes, built from its numbers.
fn frame(vector: &Value) -> Frame {
    let header = Header {
        kind: match vector["kind"].as_str().unwrap() {
            "request" => Kind::Request,
            "response" => Kind::Response,
            _ => Kind::Notification,
        },
        device: number(vector, "device_id") as u8,
        error: number(vector, "error_code") as u8,
        sub_error: number(vector, "error_sub_code"),
        session: number(vector, "session_id"),
        message: number(vector, "message_id"),
        service: number(vector, "service_id"),
        function: number(vector, "function_id"),
    };
    Frame { header, payload: bytes(vector, "payload_hex") }
}

#[test]
fn every_golden_frame_is_written_and_read_byte_for_byte() {
    for vector in golden() {
        let name = vector["name"].as_str().unwrap();
        let frame = frame(&vector);
        assert_eq!(frame.encode().unwrap(), bytes(&vector, "frame_hex"), "{name}");
        assert_eq!(frame.encode_stream().unwrap(), bytes(&vector, "tcp_hex"), "{name}");
        assert_eq!(Frame::decode(&bytes(&vector, "frame_hex")).unwrap(), frame, "{name}");
    }
}

/// Reads a payload as `M` and writes it again.
fn again<M: Message + Default>(payload: &[u8]) -> Vec<u8> {
    M::decode(payload).unwrap().encode_to_vec()
}

#[test]
fn every_golden_message_is_read_and_written_byte_for_byte() {
    // A field that is not known is dropped when read, so bytes that come back show that all are.
    let mut seen = 0;
    for vector in golden() {
        let Some(kind) = vector["message_type"].as_str() else { continue };
        let payload = bytes(&vector, "payload_hex");
        let back = match kind.trim_start_matches("Kinova.Api.") {
            "Error" => again::<common::Error>(&payload),
            "Session.CreateSessionInfo" => again::<session::CreateSessionInfo>(&payload),
            "ActuatorConfig.ControlModeInformation" => {
                again::<config::ActuatorModeInformation>(&payload)
            }
            "Base.Action" => again::<base::Action>(&payload),
            "Base.ActionHandle" => again::<base::ActionHandle>(&payload),
            "Base.ActionNotification" => again::<base::ActionNotification>(&payload),
            "Base.GripperCommand" => again::<motion::GripperCommand>(&payload),
            "Base.GripperRequest" => again::<motion::GripperRequest>(&payload),
            "Base.JointAngles" => again::<motion::JointAngles>(&payload),
            "Base.JointSpeeds" => again::<motion::JointSpeeds>(&payload),
            "Base.RequestedActionType" => again::<base::RequestedActionType>(&payload),
            "Base.ServoingModeInformation" => again::<base::ServoingModeInformation>(&payload),
            "Base.TwistCommand" => again::<motion::TwistCommand>(&payload),
            "Base.WaypointList" => again::<trajectory::WaypointList>(&payload),
            "Base.WaypointValidationReport" => {
                again::<trajectory::WaypointValidationReport>(&payload)
            }
            "BaseCyclic.Command" => again::<cyclic::Command>(&payload),
            "BaseCyclic.Feedback" => again::<cyclic::Feedback>(&payload),
            "Common.NotificationHandle" => again::<common::NotificationHandle>(&payload),
            "Common.NotificationOptions" => again::<common::NotificationOptions>(&payload),
            other => panic!("`{other}` is not read by any message"),
        };
        assert_eq!(back, payload, "{}", vector["name"]);
        seen += 1;
    }
    assert!(seen >= 25, "only {seen} messages were read");
}

#[test]
fn the_fields_of_golden_messages_mean_what_their_names_say() {
    let find = |name: &str| {
        let all = golden();
        let vector = all.iter().find(|vector| vector["name"] == name).unwrap().clone();
        (bytes(&vector, "payload_hex"), vector["message"].clone())
    };
    let (payload, _) = find("Session.CreateSession");
    let info = session::CreateSessionInfo::decode(&payload[..]).unwrap();
    assert_eq!((info.username.as_str(), info.password.as_str()), ("admin", "admin"));
    assert_eq!(
        (info.session_inactivity_timeout, info.connection_inactivity_timeout),
        (60_000, 2_000)
    );

    let (payload, told) = find("BaseCyclic Feedback");
    let feedback = cyclic::Feedback::decode(&payload[..]).unwrap();
    assert_eq!(u64::from(feedback.frame_id), told["frame_id"].as_u64().unwrap());
    for (read, told) in feedback.actuators.iter().zip(told["actuators"].as_array().unwrap()) {
        let position = told["position"].as_f64().unwrap_or(0.0);
        assert!((f64::from(read.position) - position).abs() < 1e-4, "{position}");
    }

    let (payload, told) = find("ValidateWaypointList error");
    let report = trajectory::WaypointValidationReport::decode(&payload[..]).unwrap();
    let first = &report.trajectory_error_report.unwrap().trajectory_error_elements[0];
    let told = &told["trajectory_error_report"]["trajectory_error_elements"][0];
    assert_eq!(u64::from(first.waypoint_index), told["waypoint_index"].as_u64().unwrap_or(0));
    let value = told["error_value"].as_f64().unwrap_or(0.0);
    assert!((f64::from(first.error_value) - value).abs() < 1e-4);
}

#[test]
fn golden_requests_carry_the_numbers_of_their_calls() {
    for vector in golden().iter().filter(|vector| vector["kind"] == "request") {
        let name = vector["name"].as_str().unwrap();
        let call = Rpc::find(number(vector, "service_id"), number(vector, "function_id")).unwrap();
        assert!(name.starts_with(call.name), "{name} is {call}");
    }
    assert!(rpc::ALL.windows(2).all(|pair| pair[0] < pair[1]), "a number is given twice");
}

#[test]
fn a_refusal_is_a_sentence_with_what_to_do() {
    let vectors = golden();
    let vector = vectors.iter().find(|v| v["name"] == "ExecuteAction ROBOT_IN_FAULT").unwrap();
    let frame = frame(vector);
    let header = (frame.header.error, frame.header.sub_error);
    let refusal = Refusal::read(rpc::base::EXECUTE_ACTION, header, &frame.payload);
    let text = refusal.to_string();
    assert!(
        text.starts_with("the arm is in fault (ROBOT_IN_FAULT 22, from Base.ExecuteAction)"),
        "{text}"
    );
    assert!(refusal.help().contains("clear the faults"));
    // Without a payload the header's word counts; a number nobody knows is told as one.
    let bare = Refusal::read(rpc::base::STOP, (3, 777), &[]);
    assert_eq!((bare.code, bare.sub_code), (3, 777));
    assert!(bare.to_string().contains("sub-code 777"), "{bare}");
    assert!(SUB_CODES.windows(2).all(|pair| pair[0].number < pair[1].number));
}

#[test]
fn a_length_of_four_gibibytes_is_refused_before_anything_is_kept() {
    let mut decoder = Decoder::default();
    decoder.push(&MAGIC);
    decoder.push(&u32::MAX.to_be_bytes());
    assert_eq!(decoder.next_frame(), Err(FrameError::TooLong(u32::MAX as usize)));
    assert!(decoder.waiting() <= 12);
    let mut decoder = Decoder::default();
    decoder.push(b"HTTP/1.1 ");
    assert!(matches!(decoder.next_frame(), Err(FrameError::Magic(_))));
}

#[test]
fn a_broken_frame_costs_only_itself() {
    let vectors = golden();
    let whole = bytes(&vectors[0], "tcp_hex");
    let mut decoder = Decoder::default();
    let mut broken = MAGIC.to_vec();
    broken.extend_from_slice(&[0, 0, 0, 3, 0xff, 0xff, 0xff]);
    decoder.push(&broken);
    decoder.push(&whole);
    assert!(matches!(decoder.next_frame(), Err(FrameError::Malformed(_))));
    assert_eq!(decoder.next_frame(), Ok(Some(frame(&vectors[0]))));
    assert_eq!(decoder.next_frame(), Ok(None));
}

/// Feeds a decoder frames of which some were changed, cut or run together; returns how many were read and
/// how many told as wrong.
fn feed(frames: u64, seed: u64) -> (u64, u64) {
    let mut dice = StdRng::seed_from_u64(seed);
    let whole: Vec<Vec<u8>> = golden().iter().map(|vector| bytes(vector, "tcp_hex")).collect();
    let (mut read, mut wrong) = (0, 0);
    let mut decoder = Decoder::default();
    for turn in 0..frames {
        // A wrong length may swallow megabytes, and with them all that follows: a new connection now and then.
        if turn % 16 == 0 {
            decoder = Decoder::default();
        }
        let mut bytes = whole[dice.random_range(0..whole.len())].clone();
        match dice.random_range(0..4) {
            0 => {}
            1 => {
                let at = dice.random_range(0..bytes.len());
                bytes[at] ^= 1 << dice.random_range(0..8);
            }
            2 => bytes.truncate(dice.random_range(0..bytes.len())),
            _ => {
                let at = dice.random_range(0..bytes.len());
                bytes.insert(at, dice.random());
            }
        }
        for piece in bytes.chunks(dice.random_range(1..200)) {
            decoder.push(piece);
            loop {
                match decoder.next_frame() {
                    Ok(Some(_)) => read += 1,
                    Ok(None) => break,
                    Err(FrameError::Magic(_) | FrameError::TooLong(_)) => {
                        wrong += 1;
                        // As both ends do: such a stream is at its end.
                        decoder = Decoder::default();
                        break;
                    }
                    Err(_) => wrong += 1,
                }
            }
        }
        assert!(decoder.waiting() <= LONGEST + 4096, "{} bytes are kept", decoder.waiting());
    }
    (read, wrong)
}

#[test]
fn a_million_frames_changed_cut_and_run_together_are_read_or_told_as_wrong() {
    let (read, wrong) = feed(1_000_000, 1);
    assert!(read > 100_000 && wrong > 100_000, "{read} read, {wrong} wrong");
}

fn any_frame() -> impl Strategy<Value = Frame> {
    let kind = prop_oneof![
        Just(Kind::Request),
        Just(Kind::Response),
        Just(Kind::Notification),
        prop_oneof![Just(2), Just(7), Just(8)].prop_map(Kind::Other)
    ];
    let numbers = (any::<u8>(), 0..16_u8, 0..4096_u16, any::<u16>(), any::<u16>());
    let payload = proptest::collection::vec(any::<u8>(), 0..300);
    (kind, numbers, 0..4096_u16, any::<u16>(), payload).prop_map(
        |(kind, (device, error, sub_error, session, message), service, function, payload)| Frame {
            header: Header { kind, device, error, sub_error, session, message, service, function },
            payload,
        },
    )
}

proptest! {
    #[test]
    fn what_is_written_is_read(frame in any_frame()) {
        prop_assert_eq!(Frame::decode(&frame.encode().unwrap()).unwrap(), frame);
    }

    #[test]
    fn a_stream_is_read_however_it_is_cut(
        frames in proptest::collection::vec(any_frame(), 1..6),
        cut in 1..40_usize,
    ) {
        let stream: Vec<u8> =
            frames.iter().flat_map(|frame| frame.encode_stream().unwrap()).collect();
        let mut decoder = Decoder::default();
        let mut read = Vec::new();
        for piece in stream.chunks(cut) {
            decoder.push(piece);
            while let Some(frame) = decoder.next_frame().unwrap() {
                read.push(frame);
            }
        }
        prop_assert_eq!(read, frames);
        prop_assert_eq!(decoder.waiting(), 0);
    }

    #[test]
    fn any_bytes_are_survived(bytes in proptest::collection::vec(any::<u8>(), 0..400)) {
        let _ = Frame::decode(&bytes);
        let mut stream = MAGIC.to_vec();
        stream.extend_from_slice(&bytes);
        let mut decoder = Decoder::default();
        decoder.push(&stream);
        // Each turn takes bytes away or ends: never more turns than bytes.
        for _ in 0..stream.len() {
            match decoder.next_frame() {
                Ok(None) | Err(FrameError::Magic(_) | FrameError::TooLong(_)) => break,
                Ok(Some(_)) | Err(_) => {}
            }
        }
        prop_assert!(decoder.waiting() <= LONGEST);
    }

    #[test]
    fn degrees_come_back_as_the_turn_they_left(turns in -3..3_i32, angle in -3.1..3.1_f64) {
        let there = angle + f64::from(turns) * std::f64::consts::TAU;
        let wire = degrees::to_wire(there);
        prop_assert!((0.0..360.0).contains(&wire));
        // A joint seldom turns more than a little between two readings.
        prop_assert!((degrees::from_wire(wire, there + 0.5) - there).abs() < 1e-6);
    }
}
