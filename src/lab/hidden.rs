//! Effects that a person hides in the laboratory, openly in its file or under a seal.
//!
//! A seal keeps a person from reading by accident what a game or a test has hidden; it is no cipher
//! against someone who wants to know.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};
use serde::{Deserialize, Serialize};

use super::bounds::within;
use super::{Error, Unsound};
use crate::twin::Effect;
use crate::world::{Object, Scene};

/// An effect of the vocabulary with its numbers, as a laboratory's file writes it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HiddenEffect {
    /// Its name: `lip_dribble`.
    pub name: String,
    /// Where it sits: `jar`, `joint_4`.
    pub at: String,
    /// Its numbers in SI units: `volume = 12e-6`.
    pub numbers: BTreeMap<String, f64>,
}

impl HiddenEffect {
    /// Returns the law that the laboratory adds.
    ///
    /// # Errors
    ///
    /// [`Error::Settings`] for an effect the laboratory has no law for, or a number that is missing.
    pub(super) fn law(&self) -> Result<Effect, Error> {
        let Self { name, at, numbers } = self;
        for (number, value) in numbers {
            within(&format!("effects: {number} of {name}({at})"), *value, [-1e6, 1e6])?;
        }
        Effect::known(name, at, |number| numbers.get(number).copied()).ok_or_else(|| {
            let numbers = numbers.keys().map(String::as_str).collect::<Vec<_>>().join(", ");
            Unsound::NoLaw { name: name.clone(), at: at.clone(), numbers }.into()
        })
    }
}

/// Draws an effect to hide among the things of a scene, the same for the same seed: one of the kinds that a run's
/// recording shows, as large as a kitchen may have it.
///
/// # Errors
///
/// [`Error::Settings`] if there is no vessel with water to hide it in.
pub fn draw(scene: &Scene, seed: u64) -> Result<HiddenEffect, Error> {
    let filled = |object: &Object| object.cavity.is_some_and(|cavity| cavity.filled > 0.0);
    let Some(vessel) = scene.objects.iter().find(|object| filled(object)) else {
        return Err(Unsound::NoWater(scene.name.clone()).into());
    };
    let other = scene.objects.iter().find(|o| o.cavity.is_some() && o.name != vessel.name);
    let declared = vessel.cavity.map_or(0.0, |cavity| cavity.filled);
    let mut chance = StdRng::seed_from_u64(seed ^ 0x5EA1_ED00_0000_0001);
    let mut even = |low: f64, high: f64| low + (high - low) * chance.random::<f64>();
    // What runs over needs a vessel to be poured into.
    let kinds = if other.is_some() { 5.0 } else { 4.0 };
    let mut at = vessel;
    let (name, numbers) = match even(0.0, kinds) as usize {
        0 => ("lip_dribble", vec![("volume", even(14e-6, 26e-6)), ("delay", even(1.5, 3.0))]),
        1 => ("liquid_volume", vec![("volume", declared * even(1.2, 1.5))]),
        2 => ("liquid_viscosity", vec![("viscosity", even(0.2, 0.8))]),
        3 => ("object_mass", vec![("mass", vessel.mass * even(1.6, 2.4))]),
        _ => {
            at = other.unwrap_or(vessel);
            ("overflow", vec![("level", declared * even(0.5, 0.8))])
        }
    };
    let numbers = numbers.into_iter().map(|(name, value)| (name.to_owned(), value)).collect();
    Ok(HiddenEffect { name: name.into(), at: at.name.clone(), numbers })
}

/// Length of what precedes the sealed text: a salt and a check, eight bytes each.
const HEAD: usize = 16;

/// Seals effects: hexadecimal digits that tell nothing at a glance.
pub fn seal(effects: &[HiddenEffect], salt: u64) -> String {
    let text = serde_json::to_string(effects).unwrap_or_default();
    let mut bytes = salt.to_le_bytes().to_vec();
    bytes.extend(check(text.as_bytes()).to_le_bytes());
    bytes.extend(masked(text.as_bytes(), salt));
    bytes.iter().fold(String::new(), |mut hex, byte| {
        let _ = write!(hex, "{byte:02x}");
        hex
    })
}

/// Opens a seal.
///
/// # Errors
///
/// [`Error::Settings`] for a text that is no seal, or a seal that was changed.
pub fn unseal(hex: &str) -> Result<Vec<HiddenEffect>, Error> {
    let broken = || Error::from(Unsound::Seal);
    let digits: Vec<u32> =
        hex.trim().chars().map(|c| c.to_digit(16)).collect::<Option<_>>().ok_or_else(broken)?;
    let bytes: Vec<u8> =
        digits.chunks_exact(2).map(|pair| (pair[0] * 16 + pair[1]) as u8).collect();
    if !digits.len().is_multiple_of(2) || bytes.len() < HEAD {
        return Err(broken());
    }
    let word = |from: usize| {
        bytes[from..from + 8].iter().rev().fold(0_u64, |word, byte| (word << 8) | u64::from(*byte))
    };
    let text = masked(&bytes[HEAD..], word(0));
    if check(&text) != word(8) {
        return Err(broken());
    }
    serde_json::from_slice(&text).map_err(|_| broken())
}

/// Lays a stream of chance over the bytes; twice is nothing.
fn masked(bytes: &[u8], salt: u64) -> Vec<u8> {
    let mut chance = StdRng::seed_from_u64(salt);
    bytes.iter().map(|byte| byte ^ chance.random::<u8>()).collect()
}

/// FNV-1a.
fn check(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |hash, byte| {
        (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_seal_opens_to_what_was_sealed_and_shows_when_it_was_changed() {
        let effect = HiddenEffect {
            name: "lip_dribble".into(),
            at: "jar".into(),
            numbers: [("volume".to_owned(), 12e-6), ("delay".to_owned(), 2.0)].into(),
        };
        let sealed = seal(std::slice::from_ref(&effect), 7);
        assert!(!sealed.contains("jar") && sealed.chars().all(|c| c.is_ascii_hexdigit()));
        assert_eq!(unseal(&sealed).unwrap(), vec![effect.clone()]);
        assert!(effect.law().is_ok());
        for wrong in
            ["", "xyz", &sealed[..20], &sealed[..sealed.len() - 2], &sealed.replace('7', "8")]
        {
            assert!(unseal(wrong).is_err(), "{wrong}");
        }
        let none = HiddenEffect { name: "magic".into(), ..effect };
        assert!(none.law().is_err());
    }
}
