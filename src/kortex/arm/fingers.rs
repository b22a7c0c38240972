//! The fingers: sent to an opening, at once or beside a motion, and watched until they rest.

use crate::arm::limits::ClearedGrip;
use crate::arm::{Cancel, DeviceError, Feedback, Grip};

use super::super::link::LinkError;
use super::super::messages::motion::{Finger, Gripper, GripperCommand, GripperMode};
use super::super::rpc::base;
use super::KortexArm;

/// Fingers that move less than this in a tenth of a second rest, m; a per cent of their travel is 0.85 mm.
const STILL: f64 = 5e-4;
/// Fingers this far from where they were sent were stopped by something, m.
const STOPPED_SHORT: f64 = 3e-3;

impl KortexArm {
    /// Sends the fingers and waits until they rest.
    pub(super) fn close_to(
        &mut self,
        grip: &ClearedGrip,
        cancel: &Cancel,
        watch: &mut dyn FnMut(&Feedback),
    ) -> Result<Grip, DeviceError> {
        if cancel.is_cancelled() {
            return Err(DeviceError::Stopped);
        }
        self.fingers = None;
        self.command_fingers(grip.opening())?;
        let (mut last, mut still) = (self.measure_in_motion()?.opening, 0);
        // At most five seconds: the slowest fingers need two.
        for _ in 0..50 {
            self.look_on(0.1, cancel, watch)?;
            let now = self.measure_in_motion()?.opening;
            still = if (now - last).abs() < STILL { still + 1 } else { 0 };
            last = now;
            if still >= 3 {
                break;
            }
        }
        Ok(Grip { opening: last, stalled: (last - grip.opening()).abs() > STOPPED_SHORT })
    }

    fn command_fingers(&mut self, opening: f64) -> Result<(), LinkError> {
        let closed = 1.0 - opening / self.options.max_opening;
        let finger = Finger { finger_identifier: 1, value: closed.clamp(0.0, 1.0) as f32 };
        let command = GripperCommand {
            mode: GripperMode::Position as i32,
            gripper: Some(Gripper { finger: vec![finger] }),
            duration: 0,
        };
        self.link.call_within(base::SEND_GRIPPER_COMMAND, &command, self.options.patience)
    }

    /// Sends the fingers that are to go beside a motion, once it is time.
    pub(super) fn send_fingers_when_due(&mut self) -> Result<(), LinkError> {
        match self.fingers {
            Some((due, opening)) if self.options.clock.now() >= due => {
                self.fingers = None;
                self.command_fingers(opening)
            }
            _ => Ok(()),
        }
    }
}
