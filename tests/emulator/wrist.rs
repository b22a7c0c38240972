//! What the vendor's examples 103, 104, 105, 107, 109 and 500 do with the wrist: its pins, its buses, its cameras and
//! its fingers. Calls, order and values are those of the examples.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::time::Duration;

use trueup::emulator::{Emulator, Options};
use trueup::kortex::link::{Datagrams, Link};
use trueup::kortex::messages::base::{ServoingMode, ServoingModeInformation};
use trueup::kortex::messages::common::DeviceType;
use trueup::kortex::messages::common::{RotationMatrix, RotationMatrixRow};
use trueup::kortex::messages::config::{DeviceHandles, RebootRequest};
use trueup::kortex::messages::cyclic::{
    ActuatorCommand, Command, Feedback, GripperCyclicCommand, InterconnectCommand, MotorCommand,
    ToolCommand, ToolFeedback,
};
use trueup::kortex::messages::interconnect::{
    BridgeConfig, BridgeResult, BridgeStatus, EthernetConfiguration, GpioConfiguration,
    GpioIdentification, GpioState, I2cConfiguration, I2cData, I2cReadParameter, I2cWriteParameter,
    PortIdentification, UartConfiguration,
};
use trueup::kortex::messages::vision::{
    ExtrinsicParameters, FocusPoint, IntrinsicParameters, IntrinsicProfileIdentifier, ManualFocus,
    OptionIdentifier, OptionInformation, OptionValue, SensorFocusAction, SensorIdentifier,
    TranslationVector,
};
use trueup::kortex::refusal;
use trueup::kortex::rpc::{
    base, base_cyclic, device_config, device_manager, interconnect_config as wrist, vision_config,
};

use super::{admin, eager, emulator, link};

/// The identifier of the one device of a kind, as the examples find it.
fn device(link: &Link, kind: DeviceType) -> u8 {
    let all: DeviceHandles = link.call(device_manager::READ_ALL_DEVICES, &()).unwrap();
    let mut found = all.device_handle.iter().filter(|one| one.device_type() == kind);
    let one = found.next().unwrap().device_identifier as u8;
    assert!(found.next().is_none());
    one
}

/// 103: the serial port is set up, led through the base, written to over TCP and read back.
#[test]
fn what_is_written_to_the_serial_port_comes_back_over_its_bridge() {
    let emulator = emulator(&eager());
    let link = link(&emulator);
    let at = device(&link, DeviceType::Interconnect);
    let uart = |enabled| UartConfiguration {
        port_id: 1,
        enabled,
        speed: 6,
        word_length: 2,
        stop_bits: 2,
        parity: 1,
    };
    let () = link.call_device(wrist::SET_UART_CONFIGURATION, at, &uart(true)).unwrap();
    let asked = BridgeConfig { device_identifier: at.into(), bridgetype: 1, ..Default::default() };
    let made: BridgeResult = link.call(base::ENABLE_BRIDGE, &asked).unwrap();
    assert_eq!(made.status(), BridgeStatus::Ok);
    let id = made.bridge_id.unwrap();
    let config: BridgeConfig = link.call(base::GET_BRIDGE_CONFIG, &id).unwrap();
    let port = config.port_config.unwrap().out_port as u16;
    let mut client = TcpStream::connect((emulator.tcp().ip(), port)).unwrap();
    client.set_read_timeout(Some(Duration::from_mins(1))).unwrap();
    let text = b"This data is being written on Interconnect's expansion port UART\n";
    client.write_all(text).unwrap();
    let mut back = vec![0; text.len()];
    client.read_exact(&mut back).unwrap();
    assert_eq!(&back[..], text);
    let gone: BridgeResult = link.call(base::DISABLE_BRIDGE, &id).unwrap();
    assert_eq!(gone.status(), BridgeStatus::Ok);
    let () = link.call_device(wrist::SET_UART_CONFIGURATION, at, &uart(false)).unwrap();
    // Without its bridge the port is closed.
    let mut rest = Vec::new();
    let _ = client.read_to_end(&mut rest);
    let again: BridgeResult = link.call(base::DISABLE_BRIDGE, &id).unwrap();
    assert_eq!(again.status(), BridgeStatus::NotFound);
}

/// 104: pins 1 and 2 are outputs, wired to the inputs 3 and 4.
#[test]
fn what_is_put_on_pins_1_and_2_is_read_from_pins_3_and_4() {
    let emulator = emulator(&eager());
    let link = link(&emulator);
    let at = device(&link, DeviceType::Interconnect);
    for (identifier, mode, pull) in [(1, 2, 1), (2, 2, 1), (3, 1, 2), (4, 1, 2)] {
        let pin = GpioConfiguration { identifier, mode, pull, default_value: 1 };
        let () = link.call_device(wrist::SET_GPIO_CONFIGURATION, at, &pin).unwrap();
    }
    let put = |identifier, value| {
        let state = GpioState { identifier, value };
        link.call_device::<()>(wrist::SET_GPIO_STATE, at, &state)
    };
    let read = |identifier| {
        let pin = GpioIdentification { identifier };
        let told: GpioState = link.call_device(wrist::GET_GPIO_STATE, at, &pin).unwrap();
        told.value
    };
    for (one, two) in [(2, 1), (1, 2), (2, 2), (1, 1)] {
        put(1, one).unwrap();
        put(2, two).unwrap();
        assert_eq!((read(3), read(4)), (one, two));
    }
    assert!(put(3, 2).unwrap_err().is_refusal(refusal::INVALID_PARAM));
    // The base has no pins.
    let pin = GpioIdentification { identifier: 1 };
    let base = link.call_device::<()>(wrist::GET_GPIO_STATE, 0, &pin).unwrap_err();
    assert!(base.is_refusal(refusal::INVALID_DEVICE), "{base}");
}

/// 105: an expander's pins are read, half of them turned around, and read again.
#[test]
fn half_the_pins_of_the_expander_on_the_bus_are_turned_around() {
    let emulator = emulator(&eager());
    let link = link(&emulator);
    let at = device(&link, DeviceType::Interconnect);
    let ask = I2cReadParameter {
        device: 1,
        device_address: 0x20,
        size: 1,
        timeout: 100,
        ..I2cReadParameter::default()
    };
    let read = || link.call_device::<I2cData>(wrist::I2C_READ, at, &ask);
    assert!(read().unwrap_err().is_refusal(refusal::DEVICE_NOT_READY));
    let bus = I2cConfiguration { device: 1, enabled: true, mode: 2, addressing: 1 };
    let () = link.call_device(wrist::SET_I2C_CONFIGURATION, at, &bus).unwrap();
    assert_eq!(read().unwrap().data, [0x00]);
    let data = I2cData { data: vec![0x10, 0xAA], size: 2 };
    let write = I2cWriteParameter {
        device: 1,
        device_address: 0x20,
        timeout: 100,
        data: Some(data),
        ..I2cWriteParameter::default()
    };
    let () = link.call_device(wrist::I2C_WRITE, at, &write).unwrap();
    assert_eq!(read().unwrap(), I2cData { data: vec![0xAA], size: 1 });
    let nobody = I2cReadParameter { device_address: 0x21, ..ask.clone() };
    let silent = link.call_device::<()>(wrist::I2C_READ, at, &nobody).unwrap_err();
    assert!(silent.is_refusal(refusal::METHOD_TIMEOUT), "{silent}");
    let far = I2cReadParameter { size: u32::MAX, ..ask.clone() };
    assert!(link.call_device::<()>(wrist::I2C_READ, at, &far).is_err());
    let () = link
        .call_device(
            wrist::I2C_WRITE_REGISTER,
            at,
            &I2cWriteParameter { register_address: 7, ..write.clone() },
        )
        .unwrap();
    let kept: I2cData = link
        .call_device(
            wrist::I2C_READ_REGISTER,
            at,
            &I2cReadParameter { register_address: 7, size: 2, ..ask.clone() },
        )
        .unwrap();
    assert_eq!(kept.data, [0x10, 0xAA]);
}

/// 109: the network port of the wrist.
#[test]
fn the_wrists_network_port_is_set_and_read_back() {
    let emulator = emulator(&eager());
    let link = link(&emulator);
    let at = device(&link, DeviceType::Interconnect);
    let set = EthernetConfiguration { device: 1, enabled: true, speed: 2, duplex: 2 };
    let () = link.call_device(wrist::SET_ETHERNET_CONFIGURATION, at, &set).unwrap();
    let asked = PortIdentification { device: 1 };
    let told: EthernetConfiguration =
        link.call_device(wrist::GET_ETHERNET_CONFIGURATION, at, &asked).unwrap();
    assert_eq!(told, set);
}

/// 500/01 and 02: lenses and where the cameras sit, read, changed and put back.
#[test]
fn the_cameras_lenses_and_places_are_read_changed_and_put_back() {
    let emulator = emulator(&eager());
    let link = link(&emulator);
    let at = device(&link, DeviceType::Vision);
    for sensor in [1, 2] {
        let asked = SensorIdentifier { sensor };
        let lens: IntrinsicParameters =
            link.call_device(vision_config::GET_INTRINSIC_PARAMETERS, at, &asked).unwrap();
        assert_eq!(lens.sensor, sensor);
        assert!(lens.focal_length_x > 100.0);
    }
    for (sensor, resolution) in [(1, 6), (2, 2), (1, 4)] {
        let profile = IntrinsicProfileIdentifier { sensor, resolution };
        let read = || {
            link.call_device::<IntrinsicParameters>(
                vision_config::GET_INTRINSIC_PARAMETERS_PROFILE,
                at,
                &profile,
            )
            .unwrap()
        };
        let old = read();
        let new = IntrinsicParameters { focal_length_x: 650.567_9, ..old.clone() };
        for lens in [new, old] {
            let () = link.call_device(vision_config::SET_INTRINSIC_PARAMETERS, at, &lens).unwrap();
            assert_eq!(read(), lens);
        }
    }
    let read = || {
        link.call_device::<ExtrinsicParameters>(vision_config::GET_EXTRINSIC_PARAMETERS, at, &())
            .unwrap()
    };
    let old = read();
    let row = Some(RotationMatrixRow { column1: 1.0001, column2: 0.1, column3: -0.01 });
    let new = ExtrinsicParameters {
        rotation: Some(RotationMatrix { row1: row.clone(), row2: row.clone(), row3: row }),
        translation: Some(TranslationVector { t_x: -0.026, t_y: -0.0099, t_z: 0.00002 }),
    };
    for place in [new, old] {
        let () = link.call_device(vision_config::SET_EXTRINSIC_PARAMETERS, at, &place).unwrap();
        assert_eq!(read(), place);
    }
}

/// 500/03: the lens is focused in every way there is.
#[test]
fn the_colour_camera_is_focused_in_every_way_there_is() {
    let emulator = emulator(&eager());
    let link = link(&emulator);
    let at = device(&link, DeviceType::Vision);
    let focus = |focus_action, point: Option<(u32, u32)>, manual: Option<u32>| {
        let action = SensorFocusAction {
            sensor: 1,
            focus_action,
            focus_point: point.map(|(x, y)| FocusPoint { x, y }),
            manual_focus: manual.map(|value| ManualFocus { value }),
        };
        link.call_device::<()>(vision_config::DO_SENSOR_FOCUS_ACTION, at, &action)
    };
    for action in [4, 1, 2, 3, 1] {
        focus(action, None, None).unwrap();
    }
    focus(5, Some((960, 540)), None).unwrap();
    for value in [1023, 0, 350] {
        focus(6, None, Some(value)).unwrap();
    }
    assert!(focus(6, None, Some(1024)).unwrap_err().is_refusal(refusal::VALUE_IS_ABOVE_MAXIMUM));
}

/// 500/04: every option is asked for; those that can be set are set to their ends and to their defaults, and kept
/// over a restart of the cameras.
#[test]
fn every_option_of_the_cameras_is_kept_from_one_end_to_the_other() {
    let emulator = emulator(&eager());
    let link = link(&emulator);
    let at = device(&link, DeviceType::Vision);
    let mut known: Vec<OptionInformation> = Vec::new();
    for sensor in [1, 2] {
        for option in 1..=42 {
            let asked = OptionIdentifier { sensor, option };
            let told: OptionInformation =
                link.call_device(vision_config::GET_OPTION_INFORMATION, at, &asked).unwrap();
            assert_eq!((told.sensor, told.option), (sensor, option));
            known.extend(told.supported.then_some(told));
        }
    }
    assert_eq!(known.len(), 13);
    let read = |of: &OptionInformation| -> f32 {
        let asked = OptionIdentifier { sensor: of.sensor, option: of.option };
        let told: OptionValue =
            link.call_device(vision_config::GET_OPTION_VALUE, at, &asked).unwrap();
        told.value
    };
    let set = |of: &OptionInformation, value| {
        let asked = OptionValue { sensor: of.sensor, option: of.option, value };
        link.call_device::<()>(vision_config::SET_OPTION_VALUE, at, &asked)
    };
    let ends: [fn(&OptionInformation) -> f32; 3] =
        [|one| one.maximum, |one| one.minimum, |one| one.default_value];
    for end in ends {
        for one in known.iter().filter(|one| !one.read_only) {
            set(one, end(one)).unwrap();
        }
        let restart = RebootRequest { delay: 5000 };
        let () = link.call_device(device_config::REBOOT_REQUEST, at, &restart).unwrap();
        for one in known.iter().filter(|one| !one.read_only) {
            assert!((read(one) - end(one)).abs() < 1e-9, "{one:?}");
        }
    }
    let only_read = known.iter().find(|one| one.read_only).unwrap();
    assert!(set(only_read, 0.0).is_err());
    assert!(set(&known[0], 9.0).unwrap_err().is_refusal(refusal::VALUE_IS_ABOVE_MAXIMUM));
}

/// 107: low-level servoing is entered, then nothing is sent until someone presses a key; what follows moves the
/// fingers by the cyclic command of the wrist.
fn closes_after_a_pause(emulator: &Emulator, pause: f64) -> Result<f32, u16> {
    let link = link(emulator);
    let mut cyclic = Datagrams::open(emulator.udp(), &admin()).unwrap();
    let soon = Duration::from_secs(10);
    let told: Feedback = cyclic.call(base_cyclic::REFRESH_FEEDBACK, &(), soon).unwrap();
    let before: ServoingModeInformation = link.call(base::GET_SERVOING_MODE, &()).unwrap();
    let low = ServoingModeInformation { servoing_mode: ServoingMode::LowLevel as i32 };
    let () = link.call(base::SET_SERVOING_MODE, &low).unwrap();
    let closed = |told: &Feedback| match &told.interconnect.as_ref().unwrap().tool_feedback {
        Some(ToolFeedback::GripperFeedback(gripper)) => gripper.motor[0].position,
        None => panic!("no gripper"),
    };
    let actuators = told.actuators.iter().map(|actuator| ActuatorCommand {
        position: actuator.position,
        ..ActuatorCommand::default()
    });
    let mut command = Command { frame_id: 0, actuators: actuators.collect(), interconnect: None };
    let mut motor =
        MotorCommand { motor_id: 0, position: closed(&told), velocity: 0.0, force: 100.0 };
    // Somebody thinks which key to press.
    emulator.clock().sleep(pause);
    let target = 60.0_f32;
    let mut now = closed(&told);
    for _ in 0..200_000 {
        let gripper = GripperCyclicCommand { motor_cmd: vec![motor.clone()], ..Default::default() };
        command.interconnect = Some(InterconnectCommand {
            tool_command: Some(ToolCommand::GripperCommand(gripper)),
            ..InterconnectCommand::default()
        });
        match cyclic.call::<Feedback>(base_cyclic::REFRESH, &command, soon) {
            Ok(told) => now = closed(&told),
            Err(error) => {
                assert!(error.is_refusal(refusal::WRONG_SERVOING_MODE), "{error}");
                return Err(refusal::WRONG_SERVOING_MODE);
            }
        }
        if motor.velocity == 0.0 && (target - now).abs() < 1.5 {
            break;
        }
        motor.position = target;
        motor.velocity = (2.0 * (target - now).abs()).min(100.0);
        if (target - now).abs() < 1.5 {
            motor.velocity = 0.0;
        }
    }
    let () = link.call(base::SET_SERVOING_MODE, &before).unwrap();
    Ok(now)
}

#[test]
fn the_gripper_example_moves_the_fingers_of_an_arm_that_stays_and_not_of_one_that_leaves() {
    let stays = emulator(&Options::default());
    let closed = closes_after_a_pause(&stays, 0.3).unwrap();
    assert!((closed - 60.0).abs() < 3.0, "{closed} per cent closed");
    let leaves = emulator(&Options { patience: 0.1, ..eager() });
    assert_eq!(closes_after_a_pause(&leaves, 2.5), Err(refusal::WRONG_SERVOING_MODE));
}
