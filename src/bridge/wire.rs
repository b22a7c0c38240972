//! The messages of bridge protocol 1. SI units, rad, the robot's joint order.

use serde::de::{DeserializeOwned, Error as _, Unexpected};
use serde::{Deserialize, Deserializer, Serialize};
use serde_json::Value;

use crate::arm::Mover;

/// The version of the protocol that is spoken.
pub const VERSION: u32 = 1;

/// What the client asks: an object with one key.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Request {
    /// Says which protocol and robot are meant.
    Hello {
        /// [`VERSION`].
        version: u32,
        /// The robot's folder in `stdlib/robots`.
        robot: String,
    },
    /// Lets time pass.
    Step(Step),
    /// Asks how the arm is, without letting time pass.
    Feedback {},
    /// Asks for a photograph.
    Photo {},
    /// Asks what the scales say.
    Scales {},
    /// Has the arm held where it is.
    Stop {},
}

impl Request {
    /// Returns the word it is asked with.
    pub fn word(&self) -> &'static str {
        match self {
            Self::Hello { .. } => "hello",
            Self::Step(_) => "step",
            Self::Feedback {} => "feedback",
            Self::Photo {} => "photo",
            Self::Scales {} => "scales",
            Self::Stop {} => "stop",
        }
    }
}

/// Commands from now on, and how much time passes. What is left out stands as it was.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Step {
    /// How much time passes, s.
    pub dt: f64,
    /// Joint positions, rad.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub q: Option<Vec<f64>>,
    /// Joint speeds, rad/s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dq: Option<Vec<f64>>,
    /// Where the fingers go.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub grip: Option<Aim>,
}

/// Where the fingers go.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Aim {
    /// Opening between the pads, m.
    pub opening: f64,
    /// How fast, m/s.
    pub speed: f64,
    /// With at most this force, N.
    pub force: f64,
}

/// The answer to `hello`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Hello {
    /// The version that the server speaks.
    pub hello: u32,
    /// What the server calls itself.
    #[serde(default, deserialize_with = "or_absent")]
    pub name: String,
    /// The names of its joints, in its order.
    pub joints: Vec<String>,
    /// Its camera, if it has one.
    #[serde(
        default,
        skip_serializing_if = "Option::is_none",
        deserialize_with = "object_or_absent"
    )]
    pub camera: Option<Size>,
    /// Whether it has scales.
    #[serde(default, deserialize_with = "or_absent")]
    pub scales: bool,
    /// Whether its time passes by itself.
    #[serde(default, deserialize_with = "or_absent")]
    pub realtime: bool,
}

/// Reads `null` as what is left out.
fn or_absent<'de, D, T>(from: D) -> Result<T, D::Error>
where
    D: Deserializer<'de>,
    T: Default + Deserialize<'de>,
{
    Option::<T>::deserialize(from).map(Option::unwrap_or_default)
}

/// Reads an object, or `null` as what is left out.
fn object_or_absent<'de, D, T>(from: D) -> Result<Option<T>, D::Error>
where
    D: Deserializer<'de>,
    T: DeserializeOwned,
{
    Option::<Value>::deserialize(from)?.map(object::<D, T>).transpose()
}

/// Reads a list of objects.
fn objects<'de, D, T>(from: D) -> Result<Vec<T>, D::Error>
where
    D: Deserializer<'de>,
    T: DeserializeOwned,
{
    Vec::<Value>::deserialize(from)?.into_iter().map(object::<D, T>).collect()
}

/// Reads an object. A derived reader takes a list of its values for it, too.
fn object<'de, D, T>(value: Value) -> Result<T, D::Error>
where
    D: Deserializer<'de>,
    T: DeserializeOwned,
{
    if value.is_array() {
        return Err(D::Error::invalid_type(Unexpected::Seq, &"an object"));
    }
    serde_json::from_value(value).map_err(D::Error::custom)
}

/// The size of a picture, px.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Size {
    /// Its width.
    pub width: u32,
    /// Its height.
    pub height: u32,
}

/// How the arm is.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Told {
    /// The server's own time, s.
    pub t: f64,
    /// Joint positions, rad.
    pub q: Vec<f64>,
    /// Joint speeds, rad/s.
    pub dq: Vec<f64>,
    /// Joint torques, N·m.
    pub tau: Vec<f64>,
    /// Opening between the pads, m.
    pub opening: f64,
    /// What moves by itself near the arm, all of it.
    #[serde(default, skip_serializing_if = "Vec::is_empty", deserialize_with = "objects")]
    pub moving: Vec<Mover>,
}

/// A photograph.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Photo {
    /// A PNG file in base64.
    pub png: String,
}

/// The answer to a request that failed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Refusal {
    /// What is wrong.
    pub error: String,
    /// What would help.
    #[serde(default)]
    pub help: String,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn requests_are_written_as_the_protocol_says() {
        let written = |request: &Request| serde_json::to_string(request).unwrap();
        let hello = Request::Hello { version: VERSION, robot: "gen3_2f85".into() };
        assert_eq!(written(&hello), r#"{"hello":{"version":1,"robot":"gen3_2f85"}}"#);
        let aim = Aim { opening: 0.05, speed: 0.1, force: 20.0 };
        let step = Step { dt: 0.004, q: Some(vec![0.0]), dq: Some(vec![0.5]), grip: Some(aim) };
        assert_eq!(
            written(&Request::Step(step)),
            r#"{"step":{"dt":0.004,"q":[0.0],"dq":[0.5],"grip":{"opening":0.05,"speed":0.1,"force":20.0}}}"#
        );
        let step = Step { dt: 0.004, ..Step::default() };
        assert_eq!(written(&Request::Step(step)), r#"{"step":{"dt":0.004}}"#);
        assert_eq!(written(&Request::Feedback {}), r#"{"feedback":{}}"#);
        assert_eq!(written(&Request::Stop {}), r#"{"stop":{}}"#);
    }

    #[test]
    fn what_a_server_leaves_out_it_has_not() {
        let hello: Hello =
            serde_json::from_str(r#"{"hello": 1, "joints": ["a"], "more": 2}"#).unwrap();
        assert_eq!((hello.camera, hello.scales, hello.realtime), (None, false, false));
        // Many languages write what they have not as `null`.
        let nothing = r#"{"hello": 1, "joints": ["a"], "name": null, "camera": null, "scales": null, "realtime": null}"#;
        let nulls: Hello = serde_json::from_str(nothing).unwrap();
        assert_eq!(nulls, hello);
    }
}
