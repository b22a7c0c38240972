//! What is wrong with an arm in fault: the bits of its fault banks as words.
//!
//! Names and bits from Kinova's `.proto` files of API 2.6 (`Base.SafetyIdentifier`,
//! `ActuatorConfig.SafetyIdentifierBankA`). A bit that is not listed is told by its number.

use super::messages::cyclic::Feedback;
use super::wording;

/// The base's bits.
const BASE: &[(u32, &str)] = &[
    (1, "a firmware update failed"),
    (2, "communication outside failed"),
    (4, "the base's surroundings are too hot"),
    (8, "the base is too hot"),
    (16, "a joint is in fault"),
    (32, "its cyclic data are late"),
    (64, "its list of events is full"),
    (128, "it has no kinematics for this arm"),
    (256, "a brake was not released"),
    (512, "its network failed"),
    (1024, "a pose could not be reached"),
    (2048, "a joint was not detected"),
    (4096, "its network did not start"),
    (8192, "the current is too high"),
    (16_384, "the voltage is too high"),
    (32_768, "the voltage is too low"),
    (65_536, "the tool moved too fast"),
    (131_072, "the tool turned too fast"),
    (262_144, "the tool accelerated too much"),
    (524_288, "the tool's turning accelerated too much"),
    (1_048_576, "the force at the tool is too high"),
    (2_097_152, "the torque at the tool is too high"),
    (4_194_304, "the payload is too heavy"),
    (8_388_608, "the emergency stop is active"),
    (16_777_216, "the emergency line is active"),
    (33_554_432, "the inrush current limiter failed"),
    (67_108_864, "its memory is corrupt"),
    (134_217_728, "its firmware does not fit its parts"),
    (268_435_456, "its self-test failed"),
    (536_870_912, "a discrete input is stuck"),
    (1_073_741_824, "it is in a position that is not allowed"),
];

/// A joint's bits.
const JOINT: &[(u32, &str)] = &[
    (1, "does not follow its command"),
    (2, "turned too fast"),
    (4, "is beyond the upper end of its range"),
    (8, "is beyond the lower end of its range"),
    (16, "has strain gauges that disagree"),
    (32, "has too much torque"),
    (64, "does not know its position for sure"),
    (128, "has a magnetic position that is wrong"),
    (256, "has a Hall position that is wrong"),
    (512, "has a Hall sequence that is wrong"),
    (1024, "has an encoder that disagrees with its Hall sensor"),
    (2048, "has an encoder index that is wrong"),
    (4096, "has an encoder that disagrees with its magnetic sensor"),
    (8192, "draws too much current"),
    (16_384, "has motor currents that disagree"),
    (32_768, "has too high a voltage"),
    (65_536, "has too low a voltage"),
    (131_072, "has a motor that is too hot"),
    (262_144, "has a core that is too hot"),
    (524_288, "has a corrupt memory"),
    (1_048_576, "has a motor driver in fault"),
    (2_097_152, "sees the emergency line"),
    (4_194_304, "lost communication ticks"),
    (8_388_608, "was stopped by its watchdog"),
    (16_777_216, "has a capacitive sensor that is unreliable"),
    (33_554_432, "has an unexpected gear ratio"),
    (67_108_864, "has Hall and magnetic sensors that disagree"),
    (134_217_728, "has a brake drive in fault"),
    (268_435_456, "moved too far while its brake was released"),
];

fn words(bank: u32, known: &[(u32, &str)]) -> Vec<String> {
    let each = (0..32).map(|bit| 1_u32 << bit).filter(|bit| bank & bit != 0);
    each.map(|bit| match known.iter().find(|(known, _)| *known == bit) {
        Some((_, words)) => (*words).to_owned(),
        None => wording::unknown_fault(bit),
    })
    .collect()
}

/// Returns what an arm's feedback says is wrong, the joints first; empty when nothing is.
pub fn faults(told: &Feedback) -> Vec<String> {
    let joint = |(joint, bank): (usize, u32)| {
        words(bank, JOINT).into_iter().map(move |words| format!("joint {} {words}", joint + 1))
    };
    let banks = told.actuators.iter().map(|actuator| actuator.fault_bank_a).enumerate();
    let mut all: Vec<String> = banks.flat_map(joint).collect();
    let base = told.base.as_ref().map_or(0, |base| base.fault_bank_a);
    // That a joint is in fault has been said, and better.
    let base = if all.is_empty() { base } else { base & !16 };
    all.extend(words(base, BASE));
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kortex::messages::cyclic::{ActuatorFeedback, BaseFeedback};

    #[test]
    fn every_bit_is_told_once_and_unknown_ones_by_their_number() {
        for table in [BASE, JOINT] {
            assert!(table.windows(2).all(|pair| pair[0].0 < pair[1].0));
            assert!(table.iter().all(|(bit, _)| bit.is_power_of_two()));
        }
        let bad = ActuatorFeedback { fault_bank_a: 1 | 0x8000_0000, ..ActuatorFeedback::default() };
        let base = BaseFeedback { fault_bank_a: 16 | 8_388_608, ..BaseFeedback::default() };
        let told = Feedback {
            base: Some(base),
            actuators: vec![ActuatorFeedback::default(), bad],
            ..Feedback::default()
        };
        assert_eq!(
            faults(&told),
            [
                "joint 2 does not follow its command",
                "joint 2 fault 0x80000000, which this program does not know",
                "the emergency stop is active",
            ]
        );
        assert!(faults(&Feedback::default()).is_empty());
    }
}
