//! Several things in one picture: each where the picture supports it best, none inside another, and what stands
//! behind or under another looked at again with that in front of it. Whether the picture then shows them is
//! [`super::judge`]'s.

use std::sync::Arc;

use image::GrayImage;
use nalgebra::{Point3, Vector2, Vector3};
use rayon::prelude::*;

use super::super::choice::{assign, overlap};
use super::super::doubt::Doubt;
use super::super::evidence::{Evidence, Hidden};
use super::super::outline::{Outline, Projector};
use super::super::picture::Picture;
use super::super::placement::{Candidate, Searched, Window};
use super::super::plane::Plane;
use super::stop::Stop;
use super::{FOUND, Options, Sighting, belief, judge};
use crate::world::{Camera, Object, Pose, Table};

/// What leaving an object unplaced counts in choosing places for all: the most that absent objects score.
const ABSENT: f64 = 0.3;
/// Points on each edge of what hides another thing; its hull is a polygon of them.
const HULL_POINTS: usize = 4;

/// Share of a silhouette that may belong to what is known, the arm or another thing, for what is seen there to count as a
/// look-alike. Chosen: with more than half of it gone the rest is the rim of what is known, its shadow and its
/// reflection; at a quarter a true second place half behind the arm would not be told, at three quarters the arm's own
/// outline is one.
const EXPLAINED: f64 = 0.5;
/// Points across and down a silhouette's box at which that share is asked: 144, so that it is known to some 4 %.
const ASKED: usize = 12;

/// A silhouette that is larger by this factor is that of a whole, and about as good is a score of at least this share of
/// another's. Chosen: places of one thing differ by some per cent in size, for one is farther from the eye, and by less than
/// 5 % where they are told as a tie ([`super::judge`]).
const LARGER: f64 = 1.25;
const AS_GOOD: f64 = 0.95;

/// Bases that differ by less than this, m, are on one floor: as far as what they stand on may be off.
pub(super) const SAME_FLOOR: f64 = 0.01;

/// One thing that is looked for.
pub(super) struct Sought<'a> {
    object: &'a Object,
    /// How high above the table it stands, m.
    pub(super) height: f64,
    /// The camera as this thing sees it. What stands `h` above the table looks as if it stood on it, to a camera
    /// that hangs lower by `h`.
    view: Projector,
    /// Where it is looked for; everywhere when nothing is said.
    window: Option<Window>,
    /// Masks of it that others made.
    offered: &'a [GrayImage],
}

impl<'a> Sought<'a> {
    /// Says where a thing is looked for, and on which floor.
    pub(super) fn of(object: &'a Object, camera: &Camera, options: &'a Options) -> Self {
        let height = options.raised.get(&object.name).copied().unwrap_or(0.0);
        Self {
            object,
            height,
            view: Projector::new(&lowered(camera, height)),
            window: options.windows.get(&object.name).copied(),
            offered: options.masks.get(&object.name).map_or(&[], Vec::as_slice),
        }
    }

    /// Whether a picture in colour cannot tell it from another thing, and both are looked for in one place.
    fn looks_as(&self, other: &Self) -> bool {
        self.object.colour == other.object.colour && self.has_form_of(other)
    }

    /// As [`Self::looks_as`], of a picture without colour.
    fn has_form_of(&self, other: &Self) -> bool {
        let (one, two) = (self.object, other.object);
        one.shape == two.shape
            && one.material == two.material
            && self.height.to_bits() == other.height.to_bits()
            && self.window == other.window
    }

    /// The middle of the thing at a place on its floor.
    fn middle(&self, at: &Candidate) -> Vector3<f64> {
        Vector3::new(at.x, at.y, self.height + 0.5 * self.object.shape.height())
    }
}

/// Everything that is looked for in a picture, with the picture.
pub(super) struct Everything<'a> {
    pub(super) picture: &'a Picture,
    /// What does not look like bare table.
    pub(super) change: &'a Plane,
    pub(super) table: &'a Table,
    /// Where the camera's eye is.
    pub(super) eye: Vector3<f64>,
    /// What is not to be looked at.
    pub(super) ignore: Option<Arc<GrayImage>>,
    pub(super) sought: Vec<Sought<'a>>,
    /// The wish that it ends.
    pub(super) stop: &'a Stop<'a>,
}

impl Everything<'_> {
    /// Returns what is to be said of each thing, before they are weighed against each other; nothing when it was stopped.
    pub(super) fn judged(&self) -> Vec<(Sighting, Option<Doubt>)> {
        let searched = self.searched();
        let candidates: Vec<Vec<Candidate>> = searched.iter().map(|s| s.best.clone()).collect();
        let conflict = |a: (usize, &Candidate), b: (usize, &Candidate)| self.is_same_place(a, b);
        let best: Vec<Option<Candidate>> = assign(&candidates, ABSENT, &conflict)
            .iter()
            .zip(&candidates)
            .map(|(chosen, all)| chosen.map(|k| all[k]))
            .collect();
        let said: Option<Vec<_>> = (0..self.sought.len())
            .into_par_iter()
            .map(|i| {
                if self.stop.is_asked() {
                    return None;
                }
                let evidence = self.evidence(i, self.hidden(i, &best));
                let rivals = self.rivals(i, &candidates[i], &best);
                let view = &self.sought[i].view;
                let alike = self.alike(i, &searched[i].alike, &best);
                let asked =
                    (best[i], rivals.as_slice(), alike.as_slice(), candidates[i].first().copied());
                let offered = self.sought[i].offered;
                Some(judge::judge(self.picture, view, self.table, &evidence, offered, asked))
            })
            .collect();
        said.unwrap_or_default()
    }

    /// The things that a thing differs from by nothing but its colour, where the picture has none; with the share of those of its
    /// form that have its colour, which is how probable it is that a place of that form is one of its own.
    pub(super) fn only_colour_tells(&self, i: usize) -> Option<(Vec<&str>, f64)> {
        if !self.picture.is_grey {
            return None;
        }
        let own = &self.sought[i];
        let of_form = self.sought.iter().filter(|other| own.has_form_of(other));
        let (alike, others): (Vec<&Sought>, Vec<&Sought>) =
            of_form.partition(|other| own.looks_as(other));
        let share = alike.len() as f64 / (alike.len() + others.len()) as f64;
        let names: Vec<&str> = others.iter().map(|other| other.object.name.as_str()).collect();
        (!names.is_empty()).then_some((names, share))
    }

    /// The scores of what looks like a thing elsewhere and is nothing else that is known.
    fn alike(&self, i: usize, alike: &[Candidate], best: &[Option<Candidate>]) -> Vec<f64> {
        let is_known = |c: &Candidate| {
            best.iter().enumerate().any(|(j, other)| {
                other.is_some_and(|o| {
                    (j == i || belief(&o.score) > FOUND) && {
                        let apart = self.sought[i].object.shape.outer_radius()
                            + self.sought[j].object.shape.outer_radius();
                        o.distance(c) < apart
                    }
                })
            })
        };
        let counts = |c: &&Candidate| !is_known(c) && !self.is_explained(i, c, best);
        alike.iter().filter(counts).map(|c| c.score.total).collect()
    }

    /// Whether most of what would be seen of a thing at a place is what is known to be something else: the arm, or
    /// another thing that is believed and fills its place at least as well.
    fn is_explained(&self, i: usize, at: &Candidate, best: &[Option<Candidate>]) -> bool {
        let mut known = self.bare();
        for (j, other) in best.iter().enumerate() {
            if let Some(other) = other
                && j != i
                && belief(&other.score) > FOUND
                && other.score.total >= at.score.total
            {
                known.hulls.extend_from_slice(self.outline(j, other).polygons());
            }
        }
        let outline = self.outline(i, at);
        let [u0, v0, u1, v1] = outline.bounds();
        let (mut inside, mut explained) = (0.0, 0.0);
        for k in 0..ASKED * ASKED {
            let share = |n: usize| (n as f64 + 0.5) / ASKED as f64;
            let p =
                Vector2::new(u0 + (u1 - u0) * share(k % ASKED), v0 + (v1 - v0) * share(k / ASKED));
            if outline.contains(p) {
                inside += 1.0;
                explained += f64::from(u8::from(known.covers(p)));
            }
        }
        explained > EXPLAINED * inside
    }

    /// The silhouette of a thing at a place.
    fn outline(&self, i: usize, at: &Candidate) -> Outline {
        let Sought { object, view, .. } = &self.sought[i];
        Outline::whole(view, &object.shape, &at.pose(), HULL_POINTS)
    }

    fn searched(&self) -> Vec<Searched> {
        let [low, _, high, _] = self.table.corners();
        let everywhere = Window { x: [low[0], high[0]], y: [low[1], high[1]] };
        // Things of one look are looked for once.
        let is_alike = |one: &Sought, two: &Sought| {
            if self.picture.is_grey { one.has_form_of(two) } else { one.looks_as(two) }
        };
        let first = |i: usize| (0..i).find(|j| is_alike(&self.sought[*j], &self.sought[i]));
        let firsts: Vec<usize> = (0..self.sought.len()).map(|i| first(i).unwrap_or(i)).collect();
        let search = |i: usize| {
            if firsts[i] != i || self.stop.is_asked() {
                return None;
            }
            let window = self.sought[i].window.unwrap_or(everywhere);
            let n = firsts.iter().filter(|first| **first == i).count();
            let is_stopped = || self.stop.is_asked();
            let mut searched = self.evidence(i, self.bare()).search(&window, n, &is_stopped);
            searched.best = self.without_parts(i, searched.best);
            Some(searched)
        };
        let searched: Vec<Option<Searched>> =
            (0..self.sought.len()).into_par_iter().map(search).collect();
        firsts.iter().map(|first| searched[*first].clone().unwrap_or_default()).collect()
    }

    /// Leaves out places at which a thing that is not convex would be seen as a part of what it is at another place that is
    /// about as good: a bracket turned away looks like its own plate, and then nothing explains the rest.
    fn without_parts(&self, i: usize, candidates: Vec<Candidate>) -> Vec<Candidate> {
        let outlines: Vec<Outline> = candidates.iter().map(|c| self.outline(i, c)).collect();
        let is_part = |a: usize| {
            (0..candidates.len()).any(|b| {
                let [score, other] = [a, b].map(|k| candidates[k].score.total);
                b != a && other >= AS_GOOD * score && {
                    let (whole, own) = (area(&outlines[b]), area(&outlines[a]));
                    !outlines[a].pieces.is_empty()
                        && own.0 * LARGER < whole.0
                        && own.1.iter().filter(|p| outlines[b].contains(**p)).count() as f64
                            > EXPLAINED * own.1.len() as f64
                }
            })
        };
        let parts: Vec<bool> = (0..candidates.len()).map(is_part).collect();
        let kept = candidates.into_iter().zip(parts).filter(|(_, is_part)| !is_part);
        kept.map(|(candidate, _)| candidate).collect()
    }

    fn bare(&self) -> Hidden {
        Hidden { mask: self.ignore.clone(), hulls: Vec::new() }
    }

    fn evidence(&self, i: usize, hidden: Hidden) -> Evidence<'_> {
        let Sought { object, view, .. } = &self.sought[i];
        Evidence::new(self.picture, view, object, self.change, hidden)
    }

    /// What covers a thing: all that is believed to stand nearer to the camera, or on it.
    fn hidden(&self, i: usize, best: &[Option<Candidate>]) -> Hidden {
        let mut hidden = self.bare();
        let Some(own) = best[i] else { return hidden };
        for (j, other) in best.iter().enumerate() {
            if let Some(other) = other
                && j != i
                && self.covers((j, other), (i, &own))
                && belief(&other.score) > FOUND
            {
                hidden.hulls.extend_from_slice(self.outline(j, other).polygons());
            }
        }
        hidden
    }

    /// Places of a thing that no other fills better.
    fn rivals(
        &self,
        i: usize,
        candidates: &[Candidate],
        best: &[Option<Candidate>],
    ) -> Vec<Candidate> {
        let is_taken = |c: &Candidate| {
            best.iter().enumerate().any(|(j, other)| {
                j != i
                    && other.is_some_and(|o| {
                        o.score.total >= c.score.total && self.is_same_place((i, c), (j, &o))
                    })
            })
        };
        let counts = |c: &&Candidate| !is_taken(c) && !self.is_explained(i, c, best);
        candidates.iter().filter(counts).copied().collect()
    }

    fn covers(&self, over: (usize, &Candidate), under: (usize, &Candidate)) -> bool {
        if self.is_stacked(over, under) {
            return self.sought[over.0].height > self.sought[under.0].height;
        }
        let far = |c: &Candidate| (c.x - self.eye.x).hypot(c.y - self.eye.y);
        far(over.1) < far(under.1)
    }

    /// Two things claim one place when they would share space or, on different floors, when each explains the same
    /// part of the picture: their middles are seen within half of the smaller one's radius.
    fn is_same_place(&self, a: (usize, &Candidate), b: (usize, &Candidate)) -> bool {
        if self.is_stacked(a, b) {
            return false;
        }
        let (one, two) = (&self.sought[a.0], &self.sought[b.0]);
        if (one.height - two.height).abs() < SAME_FLOOR {
            return overlap(one.object, a.1, two.object, b.1);
        }
        let (way, other) = (one.middle(a.1) - self.eye, two.middle(b.1) - self.eye);
        let beside = (other - way * (other.dot(&way) / way.norm_squared())).norm();
        beside < 0.5 * one.object.shape.outer_radius().min(two.object.shape.outer_radius())
    }

    /// Whether one of two stands on the other, or in it: on a higher floor, with its middle over the other.
    fn is_stacked(&self, a: (usize, &Candidate), b: (usize, &Candidate)) -> bool {
        let (one, two) = (&self.sought[a.0], &self.sought[b.0]);
        let stands_over = |upper: &Candidate, lower: &Sought, at: &Candidate| {
            let local =
                at.pose().isometry().inverse_transform_point(&Point3::new(upper.x, upper.y, 0.0));
            lower.object.shape.is_below(local.x, local.y)
        };
        if one.height > two.height {
            stands_over(a.1, two, b.1)
        } else {
            one.height < two.height && stands_over(b.1, one, a.1)
        }
    }
}

/// Returns the area of a silhouette, px², and points spread over it.
fn area(outline: &Outline) -> (f64, Vec<Vector2<f64>>) {
    let [u0, v0, u1, v1] = outline.bounds();
    let share = |n: usize| (n as f64 + 0.5) / ASKED as f64;
    let point = |k: usize| {
        Vector2::new(u0 + (u1 - u0) * share(k % ASKED), v0 + (v1 - v0) * share(k / ASKED))
    };
    let inside: Vec<_> = (0..ASKED * ASKED).map(point).filter(|p| outline.contains(*p)).collect();
    ((u1 - u0) * (v1 - v0) * inside.len() as f64 / (ASKED * ASKED) as f64, inside)
}

/// Returns the camera as it would hang if everything were lower by `by` m.
fn lowered(camera: &Camera, by: f64) -> Camera {
    let pose = &camera.world_from_camera;
    let world_from_camera = Pose::from_parts(pose.origin() - Vector3::z() * by, pose.rotation());
    Camera { world_from_camera, ..*camera }
}
