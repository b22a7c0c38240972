//! Arm time without the time that a person thought.
//!
//! While a person is asked the arm holds still, and its own clock may go on. Limits, intervals, relations
//! between steps and the recording are about what the arm did, so its clock stands still here for as long.

use super::limits::{Cleared, ClearedGrip};
use super::{Arm, Cancel, DeviceError, Feedback, Grip, Leader, Pacing};

/// An arm whose time stands still while a person is asked.
pub struct Patient {
    arm: Box<dyn Arm>,
    /// Time left out so far, s.
    left_out: f64,
    /// The time that is told while it stands still, s.
    standing: Option<f64>,
    /// What was told last.
    last: Option<Feedback>,
}

impl Patient {
    /// Has more patience with this arm.
    pub fn new(arm: Box<dyn Arm>) -> Self {
        Self { arm, left_out: 0.0, standing: None, last: None }
    }

    /// Returns what the arm said of itself last, without asking it.
    pub fn last(&self) -> Option<&Feedback> {
        self.last.as_ref()
    }

    /// Stops its time, or lets it go on.
    pub fn waits(&mut self, on: bool) -> Result<(), DeviceError> {
        if on {
            self.standing = Some(self.feedback()?.time);
        } else if let Some(since) = self.standing.take() {
            self.left_out = self.arm.feedback()?.time - since;
        }
        Ok(())
    }

    /// Runs a watcher on this arm's time, and keeps what was told in `last`.
    fn shifted(
        left_out: f64,
        last: &mut Option<Feedback>,
        watch: &mut dyn FnMut(&Feedback),
    ) -> impl FnMut(&Feedback) {
        move |feedback| {
            let told = Feedback { time: feedback.time - left_out, ..feedback.clone() };
            watch(&told);
            *last = Some(told);
        }
    }
}

impl Arm for Patient {
    fn feedback(&mut self) -> Result<Feedback, DeviceError> {
        let feedback = self.arm.feedback()?;
        let time = self.standing.unwrap_or(feedback.time - self.left_out);
        let told = Feedback { time, ..feedback };
        self.last = Some(told.clone());
        Ok(told)
    }

    fn follow(
        &mut self,
        trajectory: &Cleared,
        cancel: &Cancel,
        watch: &mut dyn FnMut(&Feedback),
    ) -> Result<(), DeviceError> {
        let watch = &mut Self::shifted(self.left_out, &mut self.last, watch);
        self.arm.follow(trajectory, cancel, watch)
    }

    fn led_every(&self) -> Option<f64> {
        self.arm.led_every()
    }

    fn lead(
        &mut self,
        leader: &mut Leader<'_>,
        cancel: &Cancel,
        watch: &mut dyn FnMut(&Feedback),
    ) -> Result<(), DeviceError> {
        let left_out = self.left_out;
        let mut leader = |feedback: &Feedback| {
            leader(&Feedback { time: feedback.time - left_out, ..feedback.clone() })
        };
        self.arm.lead(&mut leader, cancel, &mut Self::shifted(left_out, &mut self.last, watch))
    }

    fn grip(
        &mut self,
        grip: &ClearedGrip,
        cancel: &Cancel,
        watch: &mut dyn FnMut(&Feedback),
    ) -> Result<Grip, DeviceError> {
        self.arm.grip(grip, cancel, &mut Self::shifted(self.left_out, &mut self.last, watch))
    }

    fn send_fingers(&mut self, grip: &ClearedGrip, after: f64) -> Result<(), DeviceError> {
        self.arm.send_fingers(grip, after)
    }

    fn wait(
        &mut self,
        seconds: f64,
        cancel: &Cancel,
        watch: &mut dyn FnMut(&Feedback),
    ) -> Result<(), DeviceError> {
        self.arm.wait(seconds, cancel, &mut Self::shifted(self.left_out, &mut self.last, watch))
    }

    fn stop(&mut self) {
        self.arm.stop();
    }

    fn offers(&mut self, on: bool) {
        self.arm.offers(on);
    }

    fn is_lost(&self) -> bool {
        self.arm.is_lost()
    }

    fn owes_stop(&self) -> bool {
        self.arm.owes_stop()
    }

    fn pacing(&mut self) -> Option<Pacing> {
        self.arm.pacing()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An arm whose clock goes on whenever it is asked.
    struct Clock(f64);

    impl Arm for Clock {
        fn feedback(&mut self) -> Result<Feedback, DeviceError> {
            self.0 += 1.0;
            let none = Vec::new;
            let (q_cmd, q, dq, tau) = (none(), none(), none(), none());
            Ok(Feedback {
                time: self.0,
                q_cmd,
                q,
                dq,
                tau,
                opening: 0.0,
                mass: None,
                moving: Vec::new(),
            })
        }
        fn follow(
            &mut self,
            _: &Cleared,
            _: &Cancel,
            _: &mut dyn FnMut(&Feedback),
        ) -> Result<(), DeviceError> {
            Ok(())
        }
        fn grip(
            &mut self,
            _: &ClearedGrip,
            _: &Cancel,
            _: &mut dyn FnMut(&Feedback),
        ) -> Result<Grip, DeviceError> {
            Ok(Grip { opening: 0.0, stalled: false })
        }
        fn send_fingers(&mut self, _: &ClearedGrip, _: f64) -> Result<(), DeviceError> {
            Ok(())
        }
        fn wait(
            &mut self,
            _: f64,
            _: &Cancel,
            watch: &mut dyn FnMut(&Feedback),
        ) -> Result<(), DeviceError> {
            let feedback = self.feedback()?;
            watch(&feedback);
            Ok(())
        }
        fn stop(&mut self) {}
    }

    #[test]
    fn time_stands_still_while_a_person_is_asked() {
        let mut arm = Patient::new(Box::new(Clock(0.0)));
        let time = |arm: &mut Patient| arm.feedback().unwrap().time;
        assert_eq!(time(&mut arm) as i32, 1);
        arm.waits(true).unwrap();
        for _ in 0..10 {
            assert_eq!(time(&mut arm) as i32, 2);
        }
        arm.waits(false).unwrap();
        // The clock stood at 13 when it ended, and 2 is told; from there it goes on.
        assert_eq!(time(&mut arm) as i32, 3);
        let mut seen = 0.0;
        arm.wait(1.0, &Cancel::default(), &mut |feedback| seen = feedback.time).unwrap();
        assert_eq!(seen as i32, 4, "whoever watches sees the same time");
        assert_eq!(arm.last().unwrap().time as i32, 4, "and it is what was told last");
        // A second wish to go on changes nothing.
        arm.waits(false).unwrap();
        assert_eq!(time(&mut arm) as i32, 5);
    }
}
