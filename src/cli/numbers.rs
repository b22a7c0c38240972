//! Numbers on the command line: what is out of range is bad usage, said with the range before anything begins.

use crate::units::significant;

use super::answer::plan::MOST_SAMPLES;

/// Reads how long something may take, s.
pub(super) fn seconds(text: &str) -> Result<f64, String> {
    within(text, 0.1, 3600.0, "s")
}

/// Reads an amount of water, mL.
pub(super) fn millilitres(text: &str) -> Result<f64, String> {
    within(text, 0.0, 10_000.0, "mL")
}

/// Reads how long a trial may take, s.
pub(super) fn budget(text: &str) -> Result<f64, String> {
    within(text, 0.001, 86_400.0, "s")
}

/// Reads which share of a robot's limits is used.
pub(super) fn share(text: &str) -> Result<f64, String> {
    within(text, 0.02, 1.0, "")
}

/// Reads for how long the beat of a stream is measured, s.
#[cfg(feature = "kortex")]
pub(super) fn beat(text: &str) -> Result<f64, String> {
    within(text, 1.0, 600.0, "s")
}

/// Reads how many plans are tried.
pub(super) fn candidates(text: &str) -> Result<usize, String> {
    whole(text, 64).map(|n| n as usize)
}

/// Reads how many laboratories are tried.
pub(super) fn tries(text: &str) -> Result<u64, String> {
    whole(text, 100_000)
}

/// Reads how many samples a path is searched with.
pub(super) fn samples(text: &str) -> Result<usize, String> {
    whole(text, MOST_SAMPLES as u64).map(|n| n as usize)
}

/// Reads what all chance comes from.
pub(super) fn seed(text: &str) -> Result<u64, String> {
    text.parse().map_err(|_| format!("it should be a whole number from 0 to {}", u64::MAX))
}

fn whole(text: &str, most: u64) -> Result<u64, String> {
    let n: i128 = text.parse().map_err(|_| "it is not a whole number".to_owned())?;
    let said = || format!("it should be from 1 to {most}");
    u64::try_from(n).ok().filter(|n| (1..=most).contains(n)).ok_or_else(said)
}

fn within(text: &str, least: f64, most: f64, unit: &str) -> Result<f64, String> {
    let value: f64 = text.parse().map_err(|_| "it is not a number".to_owned())?;
    if (least..=most).contains(&value) {
        return Ok(value);
    }
    let range =
        format!("it should be from {} to {} {unit}", significant(least, 4), significant(most, 4));
    Err(range.trim_end().to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_time_to_wait_is_refused() {
        assert_eq!(seconds("20"), Ok(20.0));
        for text in ["1e300", "0", "-5", "nan", "inf", "3601"] {
            assert_eq!(seconds(text).unwrap_err(), "it should be from 0.1 to 3600 s", "{text}");
        }
        assert!(seconds("soon").is_err());
        for text in ["0", "-3", "5", "nan"] {
            assert_eq!(share(text).unwrap_err(), "it should be from 0.02 to 1", "{text}");
        }
        assert!(millilitres("-1").is_err() && millilitres("1e9").is_err());
        assert_eq!(candidates("-3").unwrap_err(), "it should be from 1 to 64");
        assert_eq!(tries("100001").unwrap_err(), "it should be from 1 to 100000");
        assert_eq!(tries("some").unwrap_err(), "it is not a whole number");
        assert_eq!(samples("0").unwrap_err(), "it should be from 1 to 1000000");
        assert_eq!(samples("200000"), Ok(200_000));
        assert_eq!(seed("0"), Ok(0));
        assert!(seed("-1").unwrap_err().starts_with("it should be a whole number from 0"));
    }
}
