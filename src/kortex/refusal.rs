//! What the arm says no with: error codes and sub-codes as sentences, each with what would help.
//!
//! Numbers and names from Kinova's `.proto` files of API 2.6; what they mean in practice from the issues of
//! its public repositories. A sub-code that is not listed is told by its number.

use super::messages::common;
use super::rpc::Rpc;

/// The arm's answer when it refuses.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Refusal {
    /// Which call was refused.
    pub rpc: Rpc,
    /// 1 protocol (the arm), 2 protocol (the client), 3 the device, 4 internal.
    pub code: u8,
    /// Why: a number of [`sub_code`].
    pub sub_code: u16,
    /// What the arm says itself; often nothing.
    pub detail: String,
}

impl Refusal {
    /// Reads a response with an error: the payload's word, or the header's where the payload has none.
    pub fn read(rpc: Rpc, header: (u8, u16), payload: &[u8]) -> Self {
        let told = <common::Error as prost::Message>::decode(payload).unwrap_or_default();
        let (code, sub_code) = if told.error_code == 0 {
            header
        } else {
            (told.error_code.clamp(0, 255) as u8, told.error_sub_code.min(0xFFFF) as u16)
        };
        Self { rpc, code, sub_code, detail: told.error_sub_string }
    }

    /// Returns what would help.
    pub fn help(&self) -> &'static str {
        sub_code(self.sub_code).map_or(
            "look the number up in the arm's API documentation; its firmware may be newer than this program",
            |known| known.help,
        )
    }
}

impl std::fmt::Display for Refusal {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match sub_code(self.sub_code) {
            Some(known) => write!(f, "{} ({} {}", known.what, known.name, known.number)?,
            None => write!(
                f,
                "the arm refused for a reason this program does not know (sub-code {}",
                self.sub_code
            )?,
        }
        write!(f, ", from {})", self.rpc)?;
        if !self.detail.is_empty() {
            write!(f, ": {}", self.detail)?;
        }
        Ok(())
    }
}

/// A sub-code in words.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SubCode {
    /// Its number.
    pub number: u16,
    /// The vendor's name.
    pub name: &'static str,
    /// What it means.
    pub what: &'static str,
    /// What would help.
    pub help: &'static str,
}

/// Returns the words of a sub-code.
pub fn sub_code(number: u16) -> Option<&'static SubCode> {
    SUB_CODES.iter().find(|known| known.number == number)
}

macro_rules! sub_codes {
    ($($number:literal $name:ident $what:literal $help:literal;)*) => {
        /// The sub-codes in words, in order of their number.
        pub const SUB_CODES: &[SubCode] = &[$(
            SubCode { number: $number, name: stringify!($name), what: $what, help: $help },
        )*];
        $(
            #[doc = $what]
            pub const $name: u16 = $number;
        )*
    };
}

sub_codes! {
    1 METHOD_FAILED "the arm tried and failed" "look at the arm's faults in its web page, clear them and try again";
    2 UNIMPLEMENTED "the arm's firmware lists the call but does not do it" "update the arm's firmware";
    3 INVALID_PARAM "the arm takes a value of the call for wrong" "tell the project: it sent a value the arm does not take";
    4 UNSUPPORTED_SERVICE "the arm does not know this service" "update the arm's firmware";
    5 UNSUPPORTED_METHOD "the arm's firmware does not know this call" "update the arm's firmware to 2.3 or newer";
    6 TOO_LARGE_ENCODED_FRAME_BUFFER "the frame is too long for the arm" "shorten the path";
    7 FRAME_ENCODING_ERR "the arm could not write its answer" "try again";
    8 FRAME_DECODING_ERR "the arm could not read the frame" "check that nothing else writes to this connection";
    9 INCOMPATIBLE_HEADER_VERSION "the arm speaks another version of the protocol" "use an arm of the Gen3 family with firmware 2.x";
    10 UNSUPPORTED_FRAME_TYPE "the arm does not take frames of this kind" "update the arm's firmware";
    11 UNREGISTERED_NOTIFICATION_RECEIVED "an unrequested notification came" "connect again";
    12 INVALID_SESSION "the session is no more: it was closed, or silent for too long" "connect again";
    13 PAYLOAD_DECODING_ERR "the arm could not read what the call carries" "tell the project which call it was";
    14 UNREGISTERED_FRAME_RECEIVED "an answer came that belongs to no question" "connect again";
    15 INVALID_PASSWORD "the arm does not take this password" "set KORTEX_PASSWORD to the password of the arm's web page";
    16 USER_NOT_FOUND "the arm knows no user of this name" "name a user of the arm's web page: kortex://USER@HOST";
    17 ENTITY_NOT_FOUND "the arm has nothing under this handle" "list what there is and name one of those";
    18 ROBOT_MOVEMENT_IN_PROGRESS "the arm is moving already" "wait until it rests, or stop it";
    19 ROBOT_NOT_MOVING "the arm is not moving" "there is nothing to pause or stop";
    20 NO_MORE_STORAGE_SPACE "the arm's memory is full" "delete actions or sequences in the arm's web page";
    21 ROBOT_NOT_READY "the arm is not ready" "wait until its light is steady green, then try again";
    22 ROBOT_IN_FAULT "the arm is in fault" "see what it touches, then clear the faults";
    23 ROBOT_IN_MAINTENANCE "the arm is in maintenance mode" "leave maintenance in the arm's web page";
    24 ROBOT_IN_UPDATE_MODE "the arm is updating its firmware" "wait until the update is done";
    25 ROBOT_IN_EMERGENCY_STOP "the arm is in emergency stop" "release the stop, make sure that no person is in reach, then clear the faults";
    26 SINGLE_LEVEL_SERVOING "the arm follows high-level commands now" "set low-level servoing first";
    27 LOW_LEVEL_SERVOING "the arm follows low-level commands now" "set single-level servoing first";
    28 MAPPING_GROUP_NON_ROOT "the controller mapping group is no root" "change the mapping in the arm's web page";
    29 MAPPING_INVALID_GROUP "the controller mapping has no such group" "change the mapping in the arm's web page";
    30 MAPPING_INVALID_MAP "the controller mapping has no such map" "change the mapping in the arm's web page";
    31 MAP_GROUP_INVALID_MAP "the mapping group has no such map" "change the mapping in the arm's web page";
    32 MAP_GROUP_INVALID_PARENT "the mapping group has no such parent" "change the mapping in the arm's web page";
    33 MAP_GROUP_INVALID_CHILD "the mapping group has no such child" "change the mapping in the arm's web page";
    34 MAP_GROUP_INVALID_MOVE "the mapping group cannot be moved there" "change the mapping in the arm's web page";
    35 MAP_IN_USE "the controller mapping is in use" "switch to another mapping first";
    36 WIFI_CONNECT_ERROR "the arm could not join the wireless network" "check name and password in the arm's web page";
    37 UNSUPPORTED_NETWORK_TYPE "the arm has no network of this type" "use its wired network";
    38 TOO_LARGE_ENCODED_PAYLOAD_BUFFER "what the call carries is too long for the arm" "shorten the path";
    39 UPDATE_PERMISSION_DENIED "this user may not change it" "connect as a user who may";
    40 DELETE_PERMISSION_DENIED "this user may not delete it" "connect as a user who may";
    41 DATABASE_ERROR "the arm's own database failed" "restart the arm";
    42 UNSUPPORTED_OPTION "the camera does not have this option" "leave the option out";
    43 UNSUPPORTED_RESOLUTION "the camera does not have this resolution" "choose one the camera lists";
    44 UNSUPPORTED_FRAME_RATE "the camera does not have this frame rate" "choose one the camera lists";
    45 UNSUPPORTED_BIT_RATE "the camera does not have this bit rate" "choose one the camera lists";
    46 UNSUPPORTED_ACTION "the arm does not know an action of this type" "update the arm's firmware";
    47 UNSUPPORTED_FOCUS_ACTION "the camera does not focus in this way" "choose one the camera lists";
    48 VALUE_IS_ABOVE_MAXIMUM "a value is above what the arm allows" "send a smaller value";
    49 VALUE_IS_BELOW_MINIMUM "a value is below what the arm allows" "send a larger value";
    50 DEVICE_DISCONNECTED "a part of the arm does not answer" "check the gripper's and the wrist's connection, then restart the arm";
    51 DEVICE_NOT_READY "a part of the arm is not ready" "wait a few seconds and try again";
    52 INVALID_DEVICE "the arm has no such device" "list the devices and name one of those";
    53 SAFETY_THRESHOLD_REACHED "a safety threshold was reached" "see which one in the arm's web page, then clear the faults";
    54 INVALID_USER_SESSION_ACCESS "this user may not do that" "connect as a user who may";
    55 CONTROL_MANUAL_STOP "the motion was stopped by hand or by a stop command" "start it again when it is safe";
    56 CONTROL_OUTSIDE_WORKSPACE "the goal is outside the arm's workspace" "choose a goal nearer to the base";
    57 CONTROL_ACTUATOR_COUNT_MISMATCH "the path has another number of joints than the arm" "use the description of this arm";
    58 CONTROL_INVALID_DURATION "a duration of the path is not allowed" "give every waypoint at least 0.01 s, and every motion the time it takes";
    59 CONTROL_INVALID_SPEED "a speed of the path is not allowed" "slow the motion down";
    60 CONTROL_LARGE_SPEED "a speed of the path is too high" "slow the motion down";
    61 CONTROL_INVALID_ACCELERATION "an acceleration of the path is not allowed" "slow the motion down";
    62 CONTROL_INVALID_TIME_STEP "the path's time step is not allowed" "send points 1 ms apart";
    63 CONTROL_LARGE_SIZE "the path has too many points" "send at most 1000 waypoints";
    64 CONTROL_WRONG_MODE "the arm is in another control mode" "set single-level servoing first";
    65 CONTROL_JOINT_POSITION_LIMIT "a joint would leave its range" "choose a goal inside the ranges of joints 2, 4 and 6";
    66 CONTROL_NO_FILE_IN_MEMORY "the arm has no path in its memory" "send the path first";
    67 CONTROL_INDEX_OUT_OF_TRAJECTORY "the path has no such point" "send the path again";
    68 CONTROL_ALREADY_RUNNING "a path is running already" "wait until it ends, or stop it";
    69 CONTROL_WRONG_STARTING_POINT "the path does not begin where the arm is" "plan again from where the arm is now";
    70 CONTROL_CARTESIAN_CANNOT_START "a motion along a line cannot begin here" "move the arm away from its singularity first";
    71 CONTROL_UNDEFINED_CONSTRAINT "the motion has neither a speed nor a duration" "give it one of the two";
    72 CONTROL_UNINITIALIZED "the arm's control is not ready" "wait a few seconds and try again";
    73 CONTROL_NO_ACTION "there is no action to control" "there is nothing to pause or stop";
    74 CONTROL_UNDEFINED "the arm's control failed and does not say why" "clear the faults and try again";
    75 WRONG_SERVOING_MODE "the arm is in another servoing mode" "set the servoing mode again: the arm leaves low-level servoing when commands come late";
    76 CONTROL_WRONG_STARTING_SPEED "the path does not begin at the arm's speed" "begin and end every motion at rest";
    100 USERNAME_LENGTH_EXCEEDED "the user's name is too long" "choose a shorter one";
    101 FIRSTNAME_LENGTH_EXCEEDED "the first name is too long" "choose a shorter one";
    102 LASTNAME_LENGTH_EXCEEDED "the last name is too long" "choose a shorter one";
    103 PASSWORD_LENGTH_EXCEEDED "the password is too long" "choose a shorter one";
    104 USERNAME_ALREADY_EXISTS "there is a user of this name" "choose another name";
    105 USERNAME_EMPTY "the user has no name" "name a user: kortex://USER@HOST";
    106 PASSWORD_NOT_CHANGED "the new password is the old one" "choose another one";
    107 MAXIMUM_USER_PROFILES_USED "the arm has no room for more users" "delete one in the arm's web page";
    108 ROUTER_UNVAILABLE "the arm's router does not answer" "restart the arm";
    120 ADDRESS_NOT_IN_VALID_RANGE "the address is not in the allowed range" "choose another one";
    121 ADDRESS_NOT_CONFIGURABLE "the address cannot be changed" "leave it as it is";
    130 SESSION_NOT_IN_CONTROL "someone else commands the arm" "ask who is connected; control is free 7.5 s after their last command";
    131 METHOD_TIMEOUT "the arm took too long inside" "try again";
    132 UNSUPPORTED_ROBOT_CONFIGURATION "the arm as it is built cannot do that" "check model and gripper in the arm's web page";
    133 NVRAM_READ_FAIL "the arm's memory cannot be read" "restart the arm; if it stays, call the vendor";
    134 NVRAM_WRITE_FAIL "the arm's memory cannot be written" "restart the arm; if it stays, call the vendor";
    135 NETWORK_NO_ADDRESS_ASSIGNED "the arm's network has no address" "set one in the arm's web page";
    136 READ_PERMISSION_DENIED "this user may not read it" "connect as a user who may";
    137 CONTROLLER_INVALID_MAPPING "the controller's mapping is not valid" "change the mapping in the arm's web page";
    138 ACTION_IN_USE "the action is running" "wait until it ends";
    139 SEND_FAILED "the arm could not send" "check the cable and connect again";
    140 CONTROL_WAYPOINT_TRAJECTORY_ABORTED "the arm gave up the path on its way" "see what stopped it, clear the faults and plan again";
    141 CONTROL_PERMISSION_DENIED "this user may not move the arm" "connect as a user who may";
}
