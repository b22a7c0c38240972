//! The messages of ROS 2 that a run is written as, with their definitions; bytes are CDR, little-endian.
//!
//! Sources: `common_interfaces`, `rcl_interfaces` and `geometry2` of ROS 2 (message definitions); OMG CDR 1.0; the MCAP registry,
//! `ros2msg`.

use byteorder::LittleEndian;
use serde::Serialize;

use crate::world::Pose;

use super::Error;

/// `builtin_interfaces/msg/Time`.
#[derive(Debug, Clone, Copy, Serialize)]
pub(super) struct Stamp {
    pub(super) sec: i32,
    pub(super) nanosec: u32,
}

/// `std_msgs/msg/Header`.
#[derive(Debug, Clone, Serialize)]
pub(super) struct Header {
    pub(super) stamp: Stamp,
    pub(super) frame_id: &'static str,
}

/// `sensor_msgs/msg/JointState`.
#[derive(Debug, Serialize)]
pub(super) struct JointState {
    pub(super) header: Header,
    pub(super) name: Vec<String>,
    pub(super) position: Vec<f64>,
    pub(super) velocity: Vec<f64>,
    pub(super) effort: Vec<f64>,
}

/// `sensor_msgs/msg/CompressedImage`.
#[derive(Debug, Serialize)]
pub(super) struct CompressedImage {
    pub(super) header: Header,
    pub(super) format: &'static str,
    pub(super) data: Vec<u8>,
}

/// `std_msgs/msg/Float64`.
#[derive(Debug, Serialize)]
pub(super) struct Float64 {
    pub(super) data: f64,
}

/// `rcl_interfaces/msg/Log`: a line of a log.
#[derive(Debug, Serialize)]
pub(super) struct Log {
    pub(super) stamp: Stamp,
    pub(super) level: u8,
    pub(super) name: &'static str,
    pub(super) msg: String,
    pub(super) file: String,
    pub(super) function: &'static str,
    pub(super) line: u32,
}

/// `diagnostic_msgs/msg/KeyValue`.
#[derive(Debug, Serialize)]
pub(super) struct KeyValue {
    pub(super) key: String,
    pub(super) value: String,
}

/// `diagnostic_msgs/msg/DiagnosticStatus`.
#[derive(Debug, Serialize)]
pub(super) struct DiagnosticStatus {
    pub(super) level: u8,
    pub(super) name: String,
    pub(super) message: &'static str,
    pub(super) hardware_id: &'static str,
    pub(super) values: Vec<KeyValue>,
}

/// `diagnostic_msgs/msg/DiagnosticArray`.
#[derive(Debug, Serialize)]
pub(super) struct DiagnosticArray {
    pub(super) header: Header,
    pub(super) status: Vec<DiagnosticStatus>,
}

/// `geometry_msgs/msg/TransformStamped`.
#[derive(Debug, Serialize)]
pub(super) struct TransformStamped {
    header: Header,
    child_frame_id: String,
    /// Translation x, y, z, m.
    translation: [f64; 3],
    /// Rotation x, y, z, w.
    rotation: [f64; 4],
}

impl TransformStamped {
    /// Returns where a thing is in a frame.
    pub(super) fn new<A, B>(header: Header, child: &str, pose: &Pose<A, B>) -> Self {
        let (at, turn) = (pose.isometry().translation, pose.isometry().rotation);
        Self {
            header,
            child_frame_id: child.to_owned(),
            translation: at.vector.into(),
            rotation: turn.coords.into(),
        }
    }
}

/// `tf2_msgs/msg/TFMessage`.
#[derive(Debug, Serialize)]
pub(super) struct TfMessage {
    pub(super) transforms: Vec<TransformStamped>,
}

/// Returns a message as CDR.
pub(super) fn cdr(message: &impl Serialize) -> Result<Vec<u8>, Error> {
    let body = cdr_encoding::to_vec::<_, LittleEndian>(message);
    let body = body.map_err(|error| Error::Format(error.to_string()))?;
    Ok([&[0, 1, 0, 0], body.as_slice()].concat())
}

/// What `std_msgs/msg/Header` is made of, as `ros2msg` wants it behind what uses it.
macro_rules! with_header {
    ($($own:literal),+) => {
        concat!(
            $($own,)+
            "================================================================================\n",
            "MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n",
            "================================================================================\n",
            "MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n"
        )
    };
}

/// Name and definition of each message.
pub(super) const JOINT_STATE: (&str, &str) = (
    "sensor_msgs/msg/JointState",
    with_header!(
        "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n"
    ),
);
/// As [`JOINT_STATE`].
pub(super) const COMPRESSED_IMAGE: (&str, &str) = (
    "sensor_msgs/msg/CompressedImage",
    with_header!("std_msgs/Header header\nstring format\nuint8[] data\n"),
);
/// As [`JOINT_STATE`].
pub(super) const FLOAT64: (&str, &str) = ("std_msgs/msg/Float64", "float64 data\n");
/// As [`JOINT_STATE`].
pub(super) const LOG: (&str, &str) = (
    "rcl_interfaces/msg/Log",
    concat!(
        "byte DEBUG=10\nbyte INFO=20\nbyte WARN=30\nbyte ERROR=40\nbyte FATAL=50\n",
        "builtin_interfaces/Time stamp\nuint8 level\nstring name\nstring msg\nstring file\n",
        "string function\nuint32 line\n",
        "================================================================================\n",
        "MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n"
    ),
);
/// As [`JOINT_STATE`].
pub(super) const DIAGNOSTIC_ARRAY: (&str, &str) = (
    "diagnostic_msgs/msg/DiagnosticArray",
    with_header!(
        "std_msgs/Header header\ndiagnostic_msgs/DiagnosticStatus[] status\n",
        "================================================================================\n",
        "MSG: diagnostic_msgs/DiagnosticStatus\n",
        "byte OK=0\nbyte WARN=1\nbyte ERROR=2\nbyte STALE=3\n",
        "byte level\nstring name\nstring message\nstring hardware_id\n",
        "diagnostic_msgs/KeyValue[] values\n",
        "================================================================================\n",
        "MSG: diagnostic_msgs/KeyValue\nstring key\nstring value\n"
    ),
);
/// As [`JOINT_STATE`].
pub(super) const TF_MESSAGE: (&str, &str) = (
    "tf2_msgs/msg/TFMessage",
    with_header!(
        "geometry_msgs/TransformStamped[] transforms\n",
        "================================================================================\n",
        "MSG: geometry_msgs/TransformStamped\n",
        "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform\n",
        "================================================================================\n",
        "MSG: geometry_msgs/Transform\n",
        "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation\n",
        "================================================================================\n",
        "MSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n",
        "================================================================================\n",
        "MSG: geometry_msgs/Quaternion\nfloat64 x\nfloat64 y\nfloat64 z\nfloat64 w\n"
    ),
);
