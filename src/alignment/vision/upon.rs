//! What looks larger than it would on the table is nearer to the eye: it stands higher, on something. Where that is a thing of
//! the scene, both are looked for once more, the one on the other.

use nalgebra::Vector2;

use super::together::SAME_FLOOR;
use super::{FOUND, Look, Options, Sighting, wording};
use crate::world::Object;

/// How far off the height may be at which a thing seems to stand, as a part of it. Chosen: some per cent of its size are told to a
/// fifth, and the steps of the edges are taken as straight.
const HEIGHT_OFF: f64 = 0.3;

/// A thing that seems to stand on another.
struct Upon<'a> {
    name: &'a str,
    carrier: &'a Object,
    /// How high the carrier bears it above the table, m.
    height: f64,
}

impl Look<'_> {
    /// Looks once more, for what stands on others there; `None` where nothing seems to, or where that look does not find more.
    pub(super) fn upon_others(
        &self,
        seen: &[Sighting],
        options: &Options,
    ) -> Option<Vec<Sighting>> {
        let upon: Vec<Upon> = seen
            .iter()
            .filter(|sighting| !options.raised.contains_key(&sighting.name))
            .filter_map(|sighting| self.upon(sighting, seen))
            .collect();
        if upon.is_empty() {
            return None;
        }
        let mut there = options.clone();
        there.raised.extend(upon.iter().map(|upon| (upon.name.to_owned(), upon.height)));
        let mut again = self.see(&there);
        let found = |seen: &[Sighting]| seen.iter().filter(|sighting| sighting.found).count();
        let is_borne = upon.iter().all(|upon| {
            let at = |name: &str| place(again.iter().find(|s| s.found && s.name == name)?);
            let places = at(upon.name).zip(at(&upon.carrier.name));
            places.is_some_and(|(a, b)| (a - b).norm() < upon.carrier.shape.outer_radius())
        });
        if !is_borne || found(&again) <= found(seen) {
            return None;
        }
        for upon in &upon {
            for sighting in again.iter_mut().filter(|sighting| sighting.name == upon.name) {
                let said = || wording::stands_upon(&upon.carrier.name, upon.height);
                sighting.ambiguous.get_or_insert_with(said);
            }
        }
        Some(again)
    }

    /// On which thing of the scene one seems to stand that was not found on the table.
    fn upon<'a>(&'a self, sighting: &'a Sighting, seen: &[Sighting]) -> Option<Upon<'a>> {
        let meaning = &sighting.checks.meaning;
        if sighting.found || meaning.raised < FOUND {
            return None;
        }
        let there = place(sighting)? + Vector2::from(meaning.shift);
        let off = (HEIGHT_OFF * meaning.height).max(SAME_FLOOR);
        let may_bear = |object: &'a Object| {
            let height = object.shape.height();
            if object.name == sighting.name || (height - meaning.height).abs() > off {
                return None;
            }
            let other = seen.iter().find(|other| other.name == object.name)?;
            let far = (place(other)? - there).norm();
            let upon = Upon { name: &sighting.name, carrier: object, height };
            (far < object.shape.outer_radius()).then_some((far, upon))
        };
        let nearest = self.scene.objects.iter().filter_map(may_bear);
        nearest.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, upon)| upon)
    }
}

/// Where a thing is, or most probably is, on the table, m.
fn place(sighting: &Sighting) -> Option<Vector2<f64>> {
    let pose = sighting.world_from_object.or(sighting.likeliest)?;
    Some(pose.origin().xy())
}
