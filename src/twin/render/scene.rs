//! The view as a list of placed solids, ready to be met by rays.

use std::sync::Arc;

use nalgebra::{Isometry3, Matrix3, Vector3};

use super::cast::Figure;
use super::solid::Solid;
use super::span::TOP;
use super::surface::Surface;
use super::view::{Body, FIRST_BODY, MARKER, Paint, Shape, TABLE, View, WATER};
use crate::twin::basin::Basin;
use crate::world::frame::times;
use crate::world::{Profile, object};

/// A solid in the world.
#[derive(Debug, Clone)]
pub(super) struct Thing {
    pub(super) kind: Kind,
    local_from_world: Matrix3<f64>,
    world_from_local: Matrix3<f64>,
    origin: Vector3<f64>,
    /// A ball that holds it, world.
    pub(super) centre: Vector3<f64>,
    pub(super) radius: f64,
    pub(super) paint: Paint,
    /// The paint's colour as linear light.
    pub(super) albedo: Vector3<f64>,
    pub(super) id: u16,
}

/// How a thing is met.
#[derive(Debug, Clone)]
pub(super) enum Kind {
    /// A convex solid.
    Solid(Solid),
    /// A solid with an open hollow, and perhaps water in it.
    Vessel(Hollow),
    /// A flat triangle `a + s ab + t ac`.
    Triangle { a: Vector3<f64>, ab: Vector3<f64>, ac: Vector3<f64> },
    /// A closed surface of triangles.
    Mesh(Surface),
}

/// An open-topped vessel in its own frame.
#[derive(Debug, Clone)]
pub(super) struct Hollow {
    pub(super) outer: Solid,
    pub(super) cavity: Solid,
    /// Height of the rim above the origin, m.
    pub(super) rim: f64,
    /// The water's surface: up in the vessel's frame, and how far up it is.
    pub(super) level: Option<(Vector3<f64>, f64)>,
}

/// Where a ray meets a thing.
#[derive(Debug, Clone, Copy)]
pub(super) struct Hit {
    pub(super) t: f64,
    /// Outward unit normal, world.
    pub(super) normal: Vector3<f64>,
    /// Tells apart faces of one thing whose common edge must be drawn finely.
    pub(super) face: u8,
    /// How deep inside a vessel, 0 at the rim or outside, 1 on its floor.
    pub(super) depth: f64,
    /// The ray meets the water in the vessel before it meets the vessel.
    pub(super) wet: bool,
}

impl Thing {
    fn new(kind: Kind, pose: &Isometry3<f64>, paint: Paint, id: u16) -> Self {
        let rotation = *pose.rotation.to_rotation_matrix().matrix();
        let (low, high) = match &kind {
            Kind::Solid(solid) => solid.bounds(),
            Kind::Vessel(hollow) => hollow.outer.bounds(),
            Kind::Triangle { a, ab, ac } => {
                let (b, c) = (a + ab, a + ac);
                (a.inf(&b).inf(&c), a.sup(&b).sup(&c))
            }
            Kind::Mesh(surface) => surface.bounds(),
        };
        Self {
            kind,
            local_from_world: rotation.transpose(),
            world_from_local: rotation,
            origin: pose.translation.vector,
            centre: pose * nalgebra::Point3::from((low + high) / 2.0) - nalgebra::Point3::origin(),
            radius: (high - low).norm() / 2.0,
            albedo: linear(paint.colour),
            paint,
            id,
        }
    }

    /// Returns a ray in the thing's own frame.
    #[inline]
    pub(super) fn inward(&self, o: Vector3<f64>, d: Vector3<f64>) -> (Vector3<f64>, Vector3<f64>) {
        (times(&self.local_from_world, &(o - self.origin)), times(&self.local_from_world, &d))
    }

    /// Returns how its frame is turned, local from world, and where its origin is in the world.
    pub(super) fn placed(&self) -> (&Matrix3<f64>, &Vector3<f64>) {
        (&self.local_from_world, &self.origin)
    }

    /// Returns a direction of the thing's frame in the world.
    #[inline]
    pub(super) fn outward(&self, d: Vector3<f64>) -> Vector3<f64> {
        times(&self.world_from_local, &d)
    }

    /// Returns a point of the thing's frame in the world.
    #[inline]
    pub(super) fn back(&self, p: Vector3<f64>) -> Vector3<f64> {
        times(&self.world_from_local, &p) + self.origin
    }

    /// Returns whether the line `o + t d`, `d` of length 1, comes near enough ahead, before `t` is `most`, to be worth a closer
    /// look.
    #[inline]
    pub(super) fn near(&self, o: Vector3<f64>, d: Vector3<f64>, most: f64) -> bool {
        let to = self.centre - o;
        let along = to.dot(&d);
        let r2 = self.radius * self.radius;
        let off = to.norm_squared() - along * along;
        off <= r2 && along - self.radius < most && (along >= 0.0 || to.norm_squared() <= r2)
    }

    /// Returns whether the thing may stand between `o` and a part of the lamp, the middle of which is `towards` (unit) and which covers
    /// twice an angle with the sine `sine`.
    #[inline]
    pub(super) fn in_beam(&self, o: Vector3<f64>, towards: Vector3<f64>, sine: f64) -> bool {
        let to = self.centre - o;
        let far2 = to.norm_squared();
        let along = to.dot(&towards);
        // The lamp's rim seen from `o` is off its middle by the sine of its half angle at most.
        let reach = self.radius + sine * far2.sqrt();
        along >= -reach && far2 - along * along <= reach * reach
    }

    /// Returns whether the thing can be met by a ray from the tip of a cone of rays. `axis` is of length 1,
    /// `slope` the tangent of half the cone's angle. It may say yes for a near miss, never no for a hit.
    pub(super) fn in_cone(&self, tip: Vector3<f64>, axis: Vector3<f64>, slope: f64) -> bool {
        // A point of the thing on a ray of the cone is no farther from the axis than the cone is wide at the
        // thing's far side; so the axis meets the thing grown by that width.
        let width = slope * ((self.centre - tip).norm() + self.radius);
        let to = self.centre - tip;
        let along = to.dot(&axis);
        let reach = self.radius + width;
        if along < -reach || to.norm_squared() - along * along > reach * reach {
            return false;
        }
        let solid = match &self.kind {
            Kind::Solid(solid) => solid,
            Kind::Vessel(hollow) => &hollow.outer,
            Kind::Triangle { .. } | Kind::Mesh(_) => return true,
        };
        let (o, d) = self.inward(tip, axis);
        solid.grown(width).span(o, d).is_some_and(|span| span.leave > 0.0)
    }

    /// Returns where a ray first meets the thing beyond `least` and before `most`, taking it as opaque: of what lies behind
    /// something else no surface is worked out.
    #[inline]
    pub(super) fn hit(
        &self,
        o: Vector3<f64>,
        d: Vector3<f64>,
        least: f64,
        most: f64,
    ) -> Option<Hit> {
        let (lo, ld) = self.inward(o, d);
        match &self.kind {
            Kind::Solid(solid) => {
                let span = solid.span(lo, ld)?;
                (span.enter > least && span.enter < most)
                    .then(|| self.report(solid, span.enter, span.enter_face, lo, ld))
            }
            Kind::Vessel(hollow) => {
                let span = hollow.outer.span(lo, ld)?;
                let inside = hollow.cavity.span(lo, ld);
                // In through the mouth, or already between the walls.
                let open = inside.filter(|c| {
                    c.leave > least
                        && (c.enter <= least
                            || (c.enter_face == TOP && c.enter <= span.enter + 1e-9))
                });
                let Some(c) = open else {
                    return (span.enter > least && span.enter < most)
                        .then(|| self.report(&hollow.outer, span.enter, span.enter_face, lo, ld));
                };
                if c.leave_face == TOP || c.leave >= most {
                    return None;
                }
                let at = lo + ld * c.leave;
                Some(Hit {
                    t: c.leave,
                    normal: -self.outward(hollow.cavity.normal(c.leave_face, at)),
                    face: c.leave_face + 8,
                    depth: 1.0 - at.z.max(0.0) / hollow.rim,
                    wet: hollow.level.is_some_and(|(up, height)| up.dot(&at) < height),
                })
            }
            Kind::Mesh(surface) => {
                let (t, normal, face) = surface.hit(lo, ld, least)?;
                (t < most).then(|| Hit {
                    t,
                    normal: self.outward(normal),
                    face,
                    depth: 0.0,
                    wet: false,
                })
            }
            Kind::Triangle { a, ab, ac } => {
                // Möller and Trumbore, 1997.
                let p = ld.cross(ac);
                let det = ab.dot(&p);
                if det.abs() < 1e-15 {
                    return None;
                }
                let s = lo - a;
                let u = s.dot(&p) / det;
                let q = s.cross(ab);
                let v = ld.dot(&q) / det;
                let t = ac.dot(&q) / det;
                if u < 0.0 || v < 0.0 || u + v > 1.0 || t <= least || t >= most {
                    return None;
                }
                let normal = self.outward(ab.cross(ac)).normalize();
                let normal = if normal.dot(&d) > 0.0 { -normal } else { normal };
                Some(Hit { t, normal, face: 0, depth: 0.0, wet: false })
            }
        }
    }

    /// Returns where a ray enters the hull of a transparent thing ahead of it.
    #[inline]
    pub(super) fn entry(&self, o: Vector3<f64>, d: Vector3<f64>) -> Option<f64> {
        let (lo, ld) = self.inward(o, d);
        let solid = match &self.kind {
            Kind::Solid(solid) => solid,
            Kind::Vessel(hollow) => &hollow.outer,
            Kind::Triangle { .. } | Kind::Mesh(_) => return None,
        };
        solid.span(lo, ld).map(|span| span.enter).filter(|&t| t > 1e-6)
    }

    /// Returns whether a point is inside the thing's outline, hollows included.
    #[inline]
    pub(super) fn holds(&self, p: Vector3<f64>) -> bool {
        let (local, _) = self.inward(p, Vector3::z());
        match &self.kind {
            Kind::Solid(solid) => solid.holds(local),
            Kind::Vessel(hollow) => hollow.outer.holds(local),
            Kind::Mesh(surface) => surface.holds(local),
            Kind::Triangle { .. } => false,
        }
    }

    /// Returns whether the thing stands between `o` and what lies far along `d`.
    #[inline]
    pub(super) fn blocks(&self, o: Vector3<f64>, d: Vector3<f64>) -> bool {
        let (lo, ld) = self.inward(o, d);
        match &self.kind {
            Kind::Solid(solid) => solid.span(lo, ld).is_some_and(|span| span.leave > 1e-6),
            Kind::Vessel(hollow) => {
                let from_wall = hollow.outer.holds(lo) && !hollow.cavity.holds(lo);
                from_wall || self.hit(o, d, 1e-6, f64::INFINITY).is_some()
            }
            Kind::Mesh(surface) => surface.blocks(lo, ld),
            Kind::Triangle { .. } => self.hit(o, d, 1e-6, f64::INFINITY).is_some(),
        }
    }

    /// Returns what it covers of the plane `z = height` seen along `d` (unit, rises), and whether what lies in that plane there does
    /// not see far along `d`: else that must be asked at each place.
    pub(super) fn figure(&self, d: Vector3<f64>, height: f64) -> Option<(Figure, bool)> {
        /// What stands on the plane may have sunk in so far, m: a part of a cell of shadows.
        const SUNK: f64 = 1e-3;
        let (solid, opens) = match &self.kind {
            Kind::Solid(solid) => (solid, false),
            // On the way up nothing comes in by the mouth.
            Kind::Vessel(hollow) => (&hollow.outer, self.world_from_local.column(2).dot(&d) <= 0.0),
            Kind::Triangle { .. } | Kind::Mesh(_) => return None,
        };
        let figure = Figure::new(solid, (&self.world_from_local, &self.origin), d, height)?;
        let up = self.world_from_local.row(2).transpose();
        let is_above = self.origin.z + solid.lowest(up) > height - SUNK;
        Some((figure, is_above && !opens))
    }

    /// Returns whether it has no hollow and no dent.
    pub(super) fn is_convex(&self) -> bool {
        matches!(self.kind, Kind::Solid(_) | Kind::Triangle { .. })
    }

    /// Returns whether a place does not see far along `d` (unit) for this thing.
    pub(super) fn hides(&self, place: Vector3<f64>, d: Vector3<f64>) -> bool {
        self.near(place, d, f64::INFINITY) && self.blocks(place, d)
    }

    #[inline]
    fn report(&self, solid: &Solid, t: f64, face: u8, o: Vector3<f64>, d: Vector3<f64>) -> Hit {
        let normal = self.outward(solid.normal(face % 8, o + d * t));
        Hit { t, normal, face, depth: 0.0, wet: false }
    }
}

/// Everything of a view that rays can meet; the table is the first.
pub(super) fn things(view: &View) -> Vec<Thing> {
    let table = view.table;
    let slab = Solid::Cuboid { centre: Vector3::zeros(), half: table.size / 2.0 };
    let [x, y] = table.centre;
    let mut things = vec![Thing::new(
        Kind::Solid(slab),
        &Isometry3::translation(x, y, -table.size.z / 2.0),
        Paint::opaque(table.colour, 0.18),
        TABLE,
    )];
    for (k, body) in view.bodies.iter().enumerate() {
        let id = FIRST_BODY + u16::try_from(k).unwrap_or(u16::MAX - FIRST_BODY);
        things.extend(of_body(body, id));
    }
    if let Some(ball) = view.marker {
        let solid = Solid::Capsule { radius: ball.radius, bottom: 0.0, top: 0.0 };
        let pose = Isometry3::translation(ball.centre.x, ball.centre.y, ball.centre.z);
        things.push(Thing::new(
            Kind::Solid(solid),
            &pose,
            Paint::opaque(ball.colour, 0.05),
            MARKER,
        ));
    }
    things.extend(free_water(view, &things));
    things
}

fn of_body(body: &Body, id: u16) -> Vec<Thing> {
    let pose = &body.world_from_body;
    let one = |kind| vec![Thing::new(kind, pose, body.paint, id)];
    match &body.shape {
        Shape::Cuboid(size) => {
            one(Kind::Solid(Solid::Cuboid { centre: Vector3::zeros(), half: size / 2.0 }))
        }
        Shape::Cylinder { radius, length } => one(Kind::Solid(Solid::Cylinder {
            radius: *radius,
            bottom: -length / 2.0,
            top: length / 2.0,
        })),
        Shape::Capsule { radius, length } => one(Kind::Solid(Solid::Capsule {
            radius: *radius,
            bottom: -length / 2.0,
            top: length / 2.0,
        })),
        Shape::Sphere(radius) => {
            one(Kind::Solid(Solid::Capsule { radius: *radius, bottom: 0.0, top: 0.0 }))
        }
        Shape::Standing(object::Shape::Mesh { mesh }) => {
            one(Kind::Mesh(Surface::new(Arc::clone(mesh))))
        }
        Shape::Standing(object::Shape::Lathe { profile }) if !profile.is_convex() => profile
            .stretches()
            .filter_map(|([r0, z0], [r1, z1])| {
                let part = Profile::cone(r0, r1, z1 - z0).ok()?;
                let solid = Solid::Lathe { profile: Arc::new(part), bottom: z0 };
                Some(Thing::new(Kind::Solid(solid), pose, body.paint, id))
            })
            .collect(),
        Shape::Standing(shape) => {
            let mut things = one(Kind::Solid(standing(shape, 0.0, 0.0)));
            things.extend(handle(shape).map(|kind| Thing::new(kind, pose, body.paint, id)));
            things
        }
        Shape::Vessel { outside, wall, water } => {
            let (outer, cavity) = (standing(outside, 0.0, 0.0), standing(outside, *wall, *wall));
            let up = pose.rotation.inverse() * Vector3::z();
            let stands = || Basin::new(outside, *wall).stand(&up, *water).height;
            let level = (*water > 1e-9).then(|| (up, stands()));
            let rim = outside.height();
            let mut things = one(Kind::Vessel(Hollow { outer, cavity, rim, level }));
            things.extend(handle(outside).map(|kind| Thing::new(kind, pose, body.paint, id)));
            things
        }
        Shape::Mesh { vertices, triangles } => triangles
            .iter()
            .filter_map(|t| {
                let [a, b, c] = [vertices.get(t[0])?, vertices.get(t[1])?, vertices.get(t[2])?];
                Some(Thing::new(
                    Kind::Triangle { a: *a, ab: b - a, ac: c - a },
                    pose,
                    body.paint,
                    id,
                ))
            })
            .collect(),
    }
}

/// The bars of a handle, if a thing has one.
fn handle(shape: &object::Shape) -> impl Iterator<Item = Kind> {
    let bars = match shape {
        object::Shape::Mug { mug } => mug.bars().to_vec(),
        _ => Vec::new(),
    };
    bars.into_iter().map(|(centre, half)| Kind::Solid(Solid::Cuboid { centre, half }))
}

/// A scene's solid, shrunk by `wall` on its sides and raised by `floor` at its bottom.
fn standing(shape: &object::Shape, wall: f64, floor: f64) -> Solid {
    match *shape {
        object::Shape::Cuboid { size } => Solid::Cuboid {
            centre: Vector3::new(0.0, 0.0, f64::midpoint(size.z, floor)),
            half: Vector3::new(size.x / 2.0 - wall, size.y / 2.0 - wall, (size.z - floor) / 2.0),
        },
        object::Shape::Cylinder { radius, height } => {
            Solid::Cylinder { radius: radius - wall, bottom: floor, top: height }
        }
        object::Shape::Mug { ref mug } => {
            let sizes = mug.sizes();
            Solid::Cylinder { radius: sizes.radius - wall, bottom: floor, top: sizes.height }
        }
        object::Shape::Mesh { ref mesh } => {
            // The box around it: its own surface is drawn where it stands, and it holds nothing.
            let half = mesh.size() / 2.0;
            Solid::Cuboid { centre: Vector3::z() * half.z, half }
        }
        object::Shape::Lathe { profile } => {
            let inside = (wall > 0.0).then(|| profile.inside(wall)).flatten();
            Solid::Lathe { profile: Arc::new(inside.unwrap_or(profile)), bottom: floor }
        }
    }
}

/// Water outside every vessel: drops in flight joined to their neighbours, flat drops on the table.
fn free_water(view: &View, things: &[Thing]) -> Vec<Thing> {
    let r = view.particle_radius;
    let glass = Paint::glass();
    let free: Vec<Vector3<f64>> = view
        .water
        .iter()
        .map(|p| p.map(f64::from))
        .filter(|p| p.iter().all(|x| x.is_finite()))
        .filter(|&p| {
            !things.iter().any(|thing| match &thing.kind {
                Kind::Vessel(hollow) => {
                    let (local, _) = thing.inward(p, Vector3::z());
                    // A margin: particles rest against walls and heap a little above the rim.
                    hollow.outer.holds(local) || hollow.cavity.holds(local - Vector3::z() * r)
                }
                _ => false,
            })
        })
        .collect();
    let mut water = Vec::new();
    for (k, p) in free.iter().enumerate() {
        let flat = p.z < 2.0 * r && view.table.holds(p.x, p.y, 0.0);
        if flat {
            // The same volume as a ball of radius r, spread as a drop on varnished wood lies.
            let half = Vector3::new(1.9 * r, 1.9 * r, r / 3.61);
            let pose = Isometry3::translation(p.x, p.y, half.z * 0.2);
            water.push(Thing::new(Kind::Solid(Solid::Ellipsoid { half }), &pose, glass, WATER));
            continue;
        }
        let next = free[k + 1..]
            .iter()
            .map(|other| other - p)
            .filter(|to| to.norm() < 3.2 * r && to.norm() > 1e-6)
            .min_by(|a, b| a.norm().total_cmp(&b.norm()));
        let (pose, top) = match next {
            Some(to) => {
                let turn = nalgebra::UnitQuaternion::rotation_between(&Vector3::z(), &to)
                    .unwrap_or_else(|| {
                        nalgebra::UnitQuaternion::from_axis_angle(
                            &Vector3::x_axis(),
                            std::f64::consts::PI,
                        )
                    });
                (Isometry3::from_parts((*p).into(), turn), to.norm())
            }
            None => (Isometry3::translation(p.x, p.y, p.z), 0.0),
        };
        let solid = Solid::Capsule { radius: 0.85 * r, bottom: 0.0, top };
        water.push(Thing::new(Kind::Solid(solid), &pose, glass, WATER));
    }
    water
}

/// Returns an sRGB colour as linear light, 0 to 1.
pub(super) fn linear(colour: [u8; 3]) -> Vector3<f64> {
    Vector3::from(colour.map(|c| {
        let c = f64::from(c) / 255.0;
        if c <= 0.040_45 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
    }))
}
