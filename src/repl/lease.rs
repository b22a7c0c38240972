//! How long lines may move an arm that is not simulated: a typed yes gives leave, ten idle minutes and any
//! fault take it back. Lines are for the twin then, as it is known now.

use std::fmt::Write as _;

use crate::report::exit::Exit;
use crate::report::{self, Failure};

use super::Session;

/// After this long without a line the leave is over, s.
const IDLE: f64 = 600.0;
/// The code of a device that failed, or that a limit stopped.
const DEVICE: &str = "device";

impl Session<'_, '_> {
    /// Whether lines move an arm that is not simulated.
    pub(super) fn is_real(&self) -> bool {
        !matches!(self.robot.as_str(), "lab" | "twin")
    }

    /// Takes note that something was typed; takes the leave back when that is long ago, and returns whether it
    /// did.
    pub(super) fn is_idle(&mut self) -> bool {
        let idle = (self.clock)() - self.last_word;
        if !self.is_real() || idle <= IDLE {
            return false;
        }
        self.drop_real(&format!("nothing was typed for {:.0} min", idle / 60.0));
        true
    }

    /// Takes the leave back when a device failed.
    pub(super) fn look_for_fault(&mut self, is_fault: bool) {
        if is_fault && self.is_real() {
            self.drop_real("a device failed");
        }
    }

    /// Whether that is how a device fails.
    pub(super) fn is_fault(failure: &Failure) -> bool {
        failure.code == DEVICE || failure.exit() == Exit::Unavailable as u8
    }

    fn drop_real(&mut self, why: &str) {
        let arm = self.robot.clone();
        match self.take_twin() {
            Ok(()) => self.style.say(format!("{why}: `:real` lets lines move the {arm} again")),
            Err(failure) => self.fail(&failure),
        }
    }

    /// `:twin`: lines are for the twin, which begins with what is known now.
    pub(super) fn take_twin(&mut self) -> Result<(), Failure> {
        if self.robot == "twin" {
            self.style.say("lines are for the twin already");
            return Ok(());
        }
        let style = self.style;
        let (mut twin, unlike) =
            self.bench.cell()?.twin().map_err(|error| report::cell_failure(&error, style))?;
        let known = twin.known_objects();
        self.aside = Some(self.bench.exchange(twin)?);
        self.robot = "twin".into();
        let mut words = String::from("lines are for the twin alone now; it begins with ");
        match known.as_slice() {
            [] => words += "the table as the scene says",
            known => {
                let _ = write!(words, "what is known of {}", known.join(", "));
            }
        }
        for line in unlike {
            let _ = write!(words, "\n  {line}");
        }
        self.style.say(words);
        Ok(())
    }
}
