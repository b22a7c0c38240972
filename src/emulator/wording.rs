//! What the emulator says beside refusals.

/// What `--fault` takes.
pub const FAULTS: &str = "drop=0.01 (share of datagrams lost), delay=20ms, stall=3s or stall=3s@10s, refuse=0.1, \
    abort=0.1, hush=0.1 (shares of paths refused, actions given up, notifications lost), unknown=0.01, \
    fault=10s, estop=10s, cut=10s, forget=10s (when sessions are forgotten), deaf=10s (from when on a stop is \
    answered and not obeyed), gripper=10s (from when on nothing is told of the gripper)";

/// There is nothing to weigh with beside the arm.
pub(super) const NO_SCALES: &str = "there are no scales";
/// What there is beside the arm, to who asks for something else.
pub(super) const PAGES: &str = "there are /photo.png and /scales.json";
