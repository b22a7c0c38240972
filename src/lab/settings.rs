//! How far the laboratory may be from what the program assumes: magnitudes, never the values drawn.
//!
//! Every field can be set in a TOML file (`trueup --lab FILE.toml`); what a file leaves out keeps its
//! default. Each topic draws its chance from its own stream, so switching one off leaves all others as
//! they were: that is what makes ablations comparable. Keys carry their units.
//!
//! ```toml
//! [switches]
//! zero_offsets = false        # everything else stays hidden and wrong
//!
//! [lens]
//! k1 = [-0.10, -0.10]         # a range of one value: always this
//!
//! [placement.fixed.cup]       # not drawn but put here
//! x_m = 0.62
//! y_m = 0.20
//! yaw_rad = 0.0
//! ```

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::hidden::{self, HiddenEffect};
use super::{Error, Unsound};
use crate::twin::Effect;
use crate::world::{Material, Object, Shape};

/// Lowest and highest value of an even draw.
pub type Range = [f64; 2];

/// Everything that may be hidden, with its size. Defaults are a laboratory put up yesterday by
/// eye, large enough that each regression is worth something; sources are said where they are known.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LabSettings {
    /// Effects hidden under a seal, empty when there are none.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub sealed: String,
    /// What is hidden at all.
    pub switches: Switches,
    /// Where the camera stands.
    pub camera: CameraError,
    /// What is inside the camera.
    pub lens: LensError,
    /// What the sensor makes of the light.
    pub sensor: Sensor,
    /// The light.
    pub light: LightError,
    /// The arm's joints.
    pub joints: JointError,
    /// Where the gripper sits on the flange, and the arm on the table.
    pub mounting: Mounting,
    /// How late commands act.
    pub latency: Latency,
    /// What encoders and torque sensors add.
    pub readings: Readings,
    /// Objects: friction, mass, water.
    pub things: Things,
    /// Who takes what is held out.
    pub people: People,
    /// Where objects are put.
    pub placement: Placement,
    /// Things that stand on the table and in no scene.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub clutter: Vec<Clutter>,
    /// Things that move through the laboratory by themselves.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub moving: Vec<Passer>,
    /// How they are watched.
    pub watch: Watch,
    /// Where the arm waits at the start.
    pub start: Start,
    /// The kitchen scale that is read while the arm moves.
    pub scale: Scale,
    /// Effects hidden openly, on top of everything above.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub effects: Vec<HiddenEffect>,
}

/// One switch per topic; off means the topic is as the program assumes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
#[expect(clippy::struct_excessive_bools, reason = "independent switches, each named in a file")]
pub struct Switches {
    /// The camera stands elsewhere.
    pub camera_pose: bool,
    /// Focal length, principal point and distortion differ.
    pub lens: bool,
    /// The sensor is noisy, blurs and vignettes.
    pub sensor: bool,
    /// Light comes from elsewhere and is weaker or stronger.
    pub light: bool,
    /// Joint encoders have wrong zeros.
    pub zero_offsets: bool,
    /// The gripper sits beside its place on the flange.
    pub tool_offset: bool,
    /// Joints have friction.
    pub joint_friction: bool,
    /// Gears give way and the weight is not fully compensated.
    pub compliance: bool,
    /// Commands act late.
    pub latency: bool,
    /// Encoders and torque sensors are noisy and biased.
    pub readings: bool,
    /// Surfaces are more or less slippery, objects heavier or lighter.
    pub surfaces: bool,
    /// The jar holds a little more or less water than the scene says.
    pub fill: bool,
}

impl Default for Switches {
    fn default() -> Self {
        Self::all(true)
    }
}

impl Switches {
    /// Returns all switches on or all off.
    pub fn all(on: bool) -> Self {
        Self {
            camera_pose: on,
            lens: on,
            sensor: on,
            light: on,
            zero_offsets: on,
            tool_offset: on,
            joint_friction: on,
            compliance: on,
            latency: on,
            readings: on,
            surfaces: on,
            fill: on,
        }
    }
}

macro_rules! section {
    ($(#[$doc:meta])* $name:ident { $($(#[$field_doc:meta])* $field:ident : $type:ty = $value:expr),* $(,)? }) => {
        $(#[$doc])*
        #[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
        #[serde(default, deny_unknown_fields)]
        pub struct $name { $($(#[$field_doc])* pub $field: $type),* }
        impl Default for $name {
            fn default() -> Self { Self { $($field: $value),* } }
        }
    };
}

section! {
    /// Where the camera stands. Normal draws are cut at two standard deviations, here and below.
    CameraError {
        /// Standard deviation along each axis, m: a tripod put down by eye.
        position_sigma_m: f64 = 0.025,
        /// Standard deviation about each axis, rad.
        turn_sigma_rad: f64 = 2.0_f64.to_radians(),
    }
}

section! {
    /// What is inside the camera.
    LensError {
        /// Focal length over the assumed one, minus 1.
        focal: Range = [-0.08, 0.08],
        /// Vertical over horizontal focal length, minus 1.
        aspect: Range = [-0.002, 0.002],
        /// Shift of the principal point along u and v, px.
        principal_px: Range = [-12.0, 12.0],
        /// First radial coefficient.
        k1: Range = [-0.25, -0.08],
        /// Second radial coefficient.
        k2: Range = [0.0, 0.03],
    }
}

section! {
    /// What the sensor makes of the light.
    Sensor {
        /// Electrons of a pixel that white paper fills; shot noise follows from it.
        full_well: f64 = 9000.0,
        /// Read noise as a part of white.
        read_noise: f64 = 0.0025,
        /// Standard deviation of the optical blur, px.
        blur_px: f64 = 0.55,
        /// Light missing in the corners, as a part.
        vignetting: Range = [0.08, 0.22],
        /// Factor on red and blue against green, minus 1.
        white_balance: Range = [-0.05, 0.05],
        /// Factor on everything, minus 1.
        exposure: Range = [-0.10, 0.08],
    }
}

section! {
    /// The kitchen scale with a cable, whose reading is recorded with the arm's; tared before a run.
    Scale {
        /// The vessel that stands on it; without such a vessel there is no scale.
        under: String = "cup".into(),
        /// Standard deviation of its noise, kg.
        sigma_kg: f64 = 3e-4,
        /// Step of its reading, kg.
        step_kg: f64 = 1e-4,
    }
}

section! {
    /// The light.
    LightError {
        /// Standard deviation of the lamp's direction about each axis, rad.
        turn_sigma_rad: f64 = 0.25,
        /// Strength of the lamp over the usual, minus 1.
        lamp: Range = [-0.25, 0.15],
        /// Strength of the room's light over the usual, minus 1.
        room: Range = [-0.12, 0.12],
    }
}

section! {
    /// The arm's joints; base to wrist all alike but for size: joints of less than 20 N·m have a third.
    JointError {
        /// Standard deviation of an encoder's zero, rad: homed by eye against marks on the shell.
        zero_sigma_rad: f64 = 0.57_f64.to_radians(),
        /// Coulomb friction, N·m. Harmonic drives of this size show 0.3 to 2.
        coulomb_nm: Range = [0.4, 1.6],
        /// Viscous friction, N·m·s/rad.
        viscous_nm_s_per_rad: Range = [0.5, 3.0],
        /// Compliance of a gear, rad/(N·m): a third of the joint's stiffness counts for small joints.
        compliance_rad_per_nm: Range = [2e-5, 8e-5],
        /// Part of the links' weight the servo does not carry.
        uncompensated: Range = [0.0, 0.04],
    }
}

section! {
    /// Where the gripper sits on the flange, and the arm on the table.
    Mounting {
        /// Standard deviation of the gripper along each axis of the flange, m.
        tool_sigma_m: f64 = 0.003,
        /// Standard deviation of the arm's base along x and y of the table, m: a clamp, not a dowel.
        base_sigma_m: f64 = 0.008,
        /// Standard deviation of the arm's base about the table's normal, rad.
        base_turn_sigma_rad: f64 = 0.7_f64.to_radians(),
    }
}

section! {
    /// How late commands act.
    Latency {
        /// From the command to the servo, s.
        command_s: Range = [0.010, 0.040],
    }
}

section! {
    /// What encoders and torque sensors add.
    Readings {
        /// Standard deviation of an angle, rad.
        q_sigma_rad: f64 = 5e-5,
        /// Step of the encoders, rad.
        q_step_rad: f64 = 1.7e-5,
        /// Standard deviation of a speed, rad/s.
        dq_sigma_rad_s: f64 = 1e-3,
        /// Standard deviation of a torque, N·m.
        tau_sigma_nm: f64 = 0.08,
        /// Constant error of a torque sensor, N·m either way.
        tau_bias_nm: Range = [-0.25, 0.25],
        /// Standard deviation of the opening, m.
        opening_sigma_m: f64 = 1e-4,
    }
}

section! {
    /// Objects: friction, mass, water.
    Things {
        /// Friction of finger pads on objects.
        pad_friction: Range = [0.65, 0.90],
        /// Friction of the table on objects.
        table_friction: Range = [0.30, 0.50],
        /// Mass of an object over the scene's, minus 1.
        mass: Range = [-0.06, 0.06],
        /// What resists a drawer, N.
        drawer_n: Range = [1.0, 8.0],
        /// Water in a vessel over the scene's, minus 1.
        fill: Range = [-0.03, 0.03],
    }
}

section! {
    /// Who stands before the arm and takes what it holds out.
    People {
        /// From the offer to the pull, s.
        delay_s: Range = [1.0, 8.0],
        /// How hard somebody pulls, N.
        pull_n: Range = [8.0, 20.0],
        /// How often somebody comes at all, as a share.
        comes: f64 = 0.8,
    }
}

section! {
    /// Where objects are put: upright, turned anyhow, on a ring around the arm's base.
    Placement {
        /// Distance of an object's axis from the base's axis, m.
        radius_m: Range = [0.55, 0.70],
        /// Largest angle to either side of the base's x axis, rad.
        side_rad: f64 = 50.0_f64.to_radians(),
        /// Distance between the axes of two objects, m.
        apart_m: Range = [0.20, 0.45],
        /// Least distance from an object to the table's edge, m.
        edge_m: f64 = 0.03,
        /// Least distance from an object to a printed mark, m.
        mark_m: f64 = 0.01,
        /// Objects with a place of their own, by name.
        fixed: BTreeMap<String, Spot> = BTreeMap::new(),
    }
}

/// A place on the table.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Spot {
    /// Along x, m.
    pub x_m: f64,
    /// Along y, m.
    pub y_m: f64,
    /// About the table's normal, rad.
    #[serde(default)]
    pub yaw_rad: f64,
}

/// A thing that stands on the table and in no scene: a box.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Clutter {
    /// Its edges along x, y and z, m.
    pub size_m: [f64; 3],
    /// Its colour, sRGB.
    pub colour: [u8; 3],
    /// Its mass, kg.
    #[serde(default = "Clutter::usual_mass")]
    pub mass_kg: f64,
}

impl Clutter {
    /// A cup of tea, kg.
    fn usual_mass() -> f64 {
        0.3
    }

    /// Returns it as an object of the laboratory's own scene; `number` tells it from others.
    pub(super) fn object(&self, number: usize) -> Object {
        Object {
            name: format!("clutter_{number}"),
            kind: "Object".to_owned(),
            shape: Shape::Cuboid { size: self.size_m.into() },
            cavity: None,
            looks: String::new(),
            material: Material::Opaque,
            colour: self.colour,
            mass: self.mass_kg,
        }
    }
}

section! {
    /// Who watches what moves by itself, as a camera or a scanner above the table does.
    Watch {
        /// From one look to the next, s.
        every_s: f64 = 1.0 / 30.0,
        /// From a look to when it is told, s.
        late_s: f64 = 0.05,
        /// Standard deviation of where something is along each axis, m.
        sigma_m: f64 = 0.003,
    }
}

/// Something that moves through the laboratory by itself: a ball on a way of its own.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Passer {
    /// What whoever watches calls it.
    pub name: String,
    /// Its radius, m.
    pub radius_m: f64,
    /// The corners of its way, straight from one to the next, m in the world.
    pub way_m: Vec<[f64; 3]>,
    /// How fast it goes, m/s.
    pub speed_m_s: f64,
    /// When it sets out, s after the laboratory was opened; until then it is at the first corner.
    #[serde(default)]
    pub begins_s: f64,
    /// Its colour, sRGB.
    #[serde(default = "Passer::usual_colour")]
    pub colour: [u8; 3],
}

impl Passer {
    /// A blue glove.
    fn usual_colour() -> [u8; 3] {
        [70, 110, 190]
    }
}

section! {
    /// Where the arm waits at the start.
    Start {
        /// Joint angles, rad; empty means Kinova's home for a 7-joint arm, zeros for others.
        q_rad: Vec<f64> = Vec::new(),
        /// Opening between the pads, m; left out, the jaws are as wide open as they go.
        #[serde(skip_serializing_if = "Option::is_none")]
        opening_m: Option<f64> = None,
    }
}

impl LabSettings {
    /// Returns a laboratory that is exactly as the program assumes; only places of objects are drawn.
    pub fn perfect() -> Self {
        Self { switches: Switches::all(false), ..Self::default() }
    }

    /// Reads settings from TOML; what is left out keeps its default.
    ///
    /// # Errors
    ///
    /// [`Error::Settings`] for text that is no TOML, an unknown key, a range turned round, a number that
    /// is not finite, or a size below zero.
    pub fn from_toml(text: &str) -> Result<Self, Error> {
        let settings: Self =
            toml::from_str(text).map_err(|error| Unsound::Toml(error.to_string()))?;
        settings.check()?;
        Ok(settings)
    }

    /// Returns what is hidden on top of everything else, openly or sealed.
    ///
    /// # Errors
    ///
    /// [`Error::Settings`] for a broken seal, or an effect that the laboratory has no law for.
    pub(super) fn laws(&self) -> Result<Vec<Effect>, Error> {
        let sealed =
            if self.sealed.is_empty() { Vec::new() } else { hidden::unseal(&self.sealed)? };
        self.effects.iter().chain(&sealed).map(HiddenEffect::law).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_changes_what_it_names_and_nothing_else() {
        let text = "[switches]\nlens = false\n[joints]\nzero_sigma_rad = 0.02\n\
                    [placement.fixed.cup]\nx_m = 0.9\ny_m = 0.1\n";
        let settings = LabSettings::from_toml(text).unwrap();
        let mut expected = LabSettings::default();
        expected.switches.lens = false;
        expected.joints.zero_sigma_rad = 0.02;
        let cup = Spot { x_m: 0.9, y_m: 0.1, yaw_rad: 0.0 };
        expected.placement.fixed.insert("cup".into(), cup);
        assert_eq!(settings, expected);
        let again = LabSettings::from_toml(&toml::to_string(&settings).unwrap()).unwrap();
        assert_eq!(again, settings, "what is written is read back");
    }

    #[test]
    fn mistakes_are_named() {
        for (text, word) in [
            ("[lens]\nk1 = [0.1, -0.1]\n", "lens.k1"),
            ("[lens]\nk3 = 1.0\n", "k3"),
            ("[readings]\ntau_sigma_nm = -1.0\n", "readings.tau_sigma_nm"),
            ("[latency]\ncommand_s = [nan, 0.1]\n", "latency.command_s"),
            ("[sensor]\nblur_px = 1e9\n", "`sensor.blur_px` = 1000000000 should be from 0 to 50"),
            ("[sensor]\nblur_px = nan\n", "sensor.blur_px"),
            ("[sensor]\nfull_well = 0.0\n", "sensor.full_well"),
            ("[lens]\nprincipal_px = [-1e300, 0.0]\n", "both from -2000 to 2000"),
            ("[latency]\ncommand_s = [0.0, 1e6]\n", "latency.command_s"),
            ("[start]\nq_rad = [0.0, inf]\n", "start.q_rad[1]"),
            (
                "[[moving]]\nname = \"\"\nradius_m = 0.1\nway_m = []\nspeed_m_s = 0.1\n",
                "`moving[0].name`: what moves needs a name of its own",
            ),
            (
                "[[moving]]\nname = \"hand\"\nradius_m = 3.0\nway_m = []\nspeed_m_s = 0.1\n",
                "moving[0].radius_m",
            ),
            ("[placement.fixed.cup]\nx_m = 1e9\ny_m = 0.0\n", "placement.fixed.cup.x_m"),
            ("nonsense", "nonsense"),
        ] {
            let Err(Error::Settings(said)) = LabSettings::from_toml(text) else { panic!("{text}") };
            assert!(said.to_string().contains(word), "{said}");
        }
    }
}
