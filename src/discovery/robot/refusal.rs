//! What helps where a recording does not go together with its robot or its model.

use std::borrow::Cow;

use super::error::Misfit;
use crate::units::significant;

/// What to do about torques that run against what the arm needs.
const TURN: &str = "turn their sign: a torque is positive when the motor drives its joint to larger \
                    angles; of motor currents that count the other way write a minus before the \
                    joint's constant in the sidecar's `torque_constant_nm_per_a`";

/// What to do about currents that run against what the arm needs.
const TURN_CURRENTS: &str = "turn their sign in the file: a current is positive when the motor drives \
                             its joint to larger angles; or say in the sidecar what every ampere is \
                             worth, with a minus where it counts the other way: \
                             `\"torque_constant_nm_per_a\": [11.6, -11.6, …]`";

impl Misfit {
    /// Returns what would help.
    pub fn help(&self) -> Cow<'static, str> {
        let help = match self {
            Self::TooManyJoints { .. }
            | Self::NoTip(_)
            | Self::NoChain { .. }
            | Self::TipElsewhere => "name the robot's file and tip, or another robot",
            Self::JointList { .. } | Self::TorqueConstants { .. } => "give one value per joint",
            Self::Controller { .. } => {
                "give one gain and one limit per joint; is it the right robot?"
            }
            Self::ControllerKind { .. } => {
                "known are `pd_with_gravity` and `pd`; leave the controller out to judge \
                 torques and tip along the measured motion"
            }
            Self::TooManyColumns { .. } => {
                "name the robot the recording was made with: `--robot-file URDF`"
            }
            Self::NothingMeasured { columns } | Self::NoMotion { columns } => {
                return Cow::Owned(format!(
                    "it has {}; rename columns with `--map 'THEIRS=q_1[rad],…'`, or give a \
                     `model` of your own with `--model`",
                    columns.join(", ")
                ));
            }
            Self::OnlyContacts => {
                "give a run in which the arm moves freely as well, or hold another part out with \
                 `--holdout`"
            }
            Self::NothingPredicted => {
                "record torques (`tau_n`) or the tip (`tcp_x`), or say in the sidecar what the \
                 controller is: then positions can be predicted too"
            }
            Self::Coarse { .. } => {
                "name the unit of time in the header, such as `t[ms]`, or record more often"
            }
            Self::Clock { unit, .. } => {
                let unit = unit.symbol();
                return Cow::Owned(format!(
                    "say so in the header, `t[{unit}]`, or with `--map 't=t[{unit}]'`"
                ));
            }
            Self::Paced { ratio, .. } => return Cow::Owned(paced(*ratio)),
            Self::Scaled { pair, .. } => {
                return Cow::Owned(format!(
                    "write the unit of each column in the header, such as `{}`, or give it with `--map`",
                    pair.headers()
                ));
            }
            Self::Against { .. } => {
                "turn the sign of one of the two: both are positive the same way round"
            }
            Self::OfAnother { .. } => {
                "put the columns into the order of the joints, base first, or rename them with `--map`"
            }
            Self::BeyondLimits { .. } => {
                "if it is in degrees, say so in the header, `q_1[deg]`; if the arm is another, name \
                 its file with `--robot-file`"
            }
            Self::BeyondReach { .. } => {
                "if it is in millimetres, say so in the header: `tcp_x[mm]`"
            }
            Self::TorquesScaled { ratio, .. } if *ratio < 0.0 => TURN,
            Self::Weightless { .. } => {
                "if the controller has taken the weight out, say so in the sidecar: `\"gravity_m_s2\": 0`"
            }
            Self::Mounted { gravity, .. } => return Cow::Owned(mounted(gravity)),
            Self::TorquesAgainst { .. } | Self::TorqueTurned { .. } => TURN,
            Self::HardlyMoves { .. } => {
                "record while every joint turns both ways, slowly and fast; of poses at rest give one row each, without a time"
            }
            Self::TooShort { .. } => {
                "record for longer: every joint has to turn both ways, slowly and fast, several times in the part that is fitted; \
                 a second recording may be held out"
            }
            Self::TorquesScaled { ratio, of_currents: true, .. } => {
                return Cow::Owned(geared(*ratio));
            }
            Self::TorquesScaled { .. } => {
                "say their unit in the header, such as `tau_1[mN*m]`, or name the arm with `--robot-file`"
            }
            Self::CurrentsAgainst { .. } => TURN_CURRENTS,
            Self::CurrentsUnrelated | Self::CurrentsAtRest => {
                "say it in the sidecar: `\"torque_constant_nm_per_a\": [11.6, …]`, N·m at the joint"
            }
            Self::TooFewPoses { .. } => {
                "take 20 poses or more, all over the workspace, with every joint turned both ways"
            }
            Self::EffectUnit { .. }
            | Self::EffectLacks { .. }
            | Self::EffectJoint { .. }
            | Self::EffectChannel { .. } => {
                "see the vocabulary of effects for names, places and parameters"
            }
            Self::RunsAway | Self::NoOutcome { is_at_rest: false, .. } => {
                "check the units of the columns, the robot's file and the controller's gains"
            }
            Self::NoOutcome { is_at_rest: true, .. } => {
                "check the units of the columns and the robot's file"
            }
        };
        Cow::Borrowed(help)
    }
}

/// Says what to do about stamps and speeds that are off by one factor.
fn paced(ratio: f64) -> String {
    format!(
        "accelerations rest on both, so no effect is named: if the rows were taken at another rate than `t` says, \
         divide `t` by {}; if the speeds are wrong, correct them or leave the columns `dq_n` out",
        significant(ratio, 3)
    )
}

/// Says what to do about an arm whose torques are of another gravity, m/s² in the base's axes.
fn mounted(gravity: &[f64; 3]) -> String {
    let [x, y, z] = gravity.map(|part| significant(part, 3));
    format!(
        "say so in the sidecar: `\"gravity_m_s2\": [{x}, {y}, {z}]`; for an arm that stands upright, a joint's \
         zero or the order of the columns is another"
    )
}

/// Says what to do about currents that, times their constants, are `ratio` times what an arm needs.
fn geared(ratio: f64) -> String {
    format!(
        "`torque_constant_nm_per_a` is N·m at the joint for each ampere: the motor's own constant times the ratio of the gear, \
         which would be about {} times what the sidecar says; if the currents are in another unit, say so in the header, such \
         as `current_1[mA]`",
        significant(1.0 / ratio, 2)
    )
}
