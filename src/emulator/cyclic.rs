//! Service 3, `BaseCyclic`: one feedback a call, and in low-level servoing one command a cycle.
//!
//! Currents, voltages and temperatures are constants; the wrench is not estimated. The torque's sign is the
//! wire's: opposite to the way the joint is driven (the vendor's torque example).

/// How long the first command may take after the mode was set, s.
const FIRST: f64 = 2.0;
/// After so long a silence joints that were told speeds or torques hold, s; chosen.
pub(super) const SILENT: f64 = 0.1;

/// `ActuatorCyclic.StatusFlags`: position control is on, and calibrated.
pub(super) const SERVOING: u32 = 2048;
/// `ActuatorConfig.SafetyIdentifierBankA`: the joint is behind, turned too fast, is beyond an end of its range.
pub(super) const FOLLOWING_ERROR: u32 = 1;
pub(super) const MAXIMUM_VELOCITY: u32 = 2;
pub(super) const JOINT_LIMIT_HIGH: u32 = 4;
pub(super) const JOINT_LIMIT_LOW: u32 = 8;
/// `Base.SafetyIdentifier`: a joint is in fault; the emergency stop is active.
pub(super) const JOINT_FAULT: u32 = 16;
pub(super) const EMERGENCY_STOP_ACTIVATED: u32 = 8_388_608;
/// `GripperConfig.RobotiqGripperStatusFlags`: ready, holding something, where it was sent.
pub(super) const INITIALIZED: u32 = 1;
pub(super) const OBJECT_DETECTED: u32 = 2;
pub(super) const POS_REACHED: u32 = 4;

/// The stream of low-level commands.
#[derive(Debug, Clone, Copy)]
pub(super) struct Stream {
    /// Low-level servoing is left when no command comes for so long, s of the arm's time: a machine that
    /// lets nobody run for a while does not let the arm's time pass either. Infinite where it is not left.
    patience: f64,
    /// When the last command came, s of the arm's time.
    pub(super) heard: f64,
    /// Until when the next command must come, s of the arm's time.
    pub(super) until: f64,
    /// The last frame's number, and how many were taken.
    last: Option<u32>,
    /// How many commands came in low-level servoing.
    pub(super) taken: u64,
    /// How many of them were older than the one before, and were passed over.
    pub(super) late: u64,
    /// How many times the arm left low-level servoing because nothing came.
    pub(super) starved: u64,
}

impl Stream {
    /// Waits so long for each command, s.
    pub(super) fn new(patience: f64) -> Self {
        Self { patience, heard: 0.0, until: 0.0, last: None, taken: 0, late: 0, starved: 0 }
    }

    /// Expects the first command from now on, s.
    pub(super) fn expect(&mut self, now: f64) {
        self.until = now + self.patience.max(FIRST);
        self.heard = now;
        self.last = None;
    }

    /// Takes a frame's number; false if a newer one was taken already.
    pub(super) fn is_new(&mut self, frame: u32, now: f64) -> bool {
        self.until = now + self.patience;
        self.heard = now;
        self.taken += 1;
        // Numbers run to 65535 and begin again: half a turn back is old, half a turn ahead is new. The same
        // number again is a client that does not count, as in the vendor's gripper example.
        let is_new = self.last.is_none_or(|last| {
            let ahead = frame.wrapping_sub(last) & 0xFFFF;
            ahead < 0x8000
        });
        if is_new {
            self.last = Some(frame);
        } else {
            self.late += 1;
        }
        is_new
    }
}
