//! Numbers on the command line: what is out of range is bad usage, said with the range before anything begins.

use crate::units::significant;

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

/// Reads for how long the beat of a stream is measured, s.
#[cfg(feature = "kortex")]
pub(super) fn beat(text: &str) -> Result<f64, String> {
    within(text, 1.0, 600.0, "s")
}

/// Reads how many plans are tried.
pub(super) fn candidates(text: &str) -> Result<usize, String> {
    let n: i64 = text.parse().map_err(|_| "it is not a whole number".to_owned())?;
    if (1..=64).contains(&n) { Ok(n as usize) } else { Err("it should be from 1 to 64".to_owned()) }
}

fn within(text: &str, least: f64, most: f64, unit: &str) -> Result<f64, String> {
    let value: f64 = text.parse().map_err(|_| "it is not a number".to_owned())?;
    if (least..=most).contains(&value) {
        return Ok(value);
    }
    Err(format!("it should be from {} to {} {unit}", significant(least, 4), significant(most, 4)))
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
        assert!(millilitres("-1").is_err() && millilitres("1e9").is_err());
        assert_eq!(candidates("-3").unwrap_err(), "it should be from 1 to 64");
    }
}
