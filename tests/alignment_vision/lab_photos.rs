//! Photographs of the laboratory with known truth: what is judged is seeing, not the camera's alignment.
//!
//! Places are drawn here and given to the laboratory as `placement.fixed`, so that they are known without
//! looking behind its curtain. The camera is the one that regressions 1 and 2 find on the bare table.

use image::{GrayImage, RgbImage};
use nalgebra::Isometry3;
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};
use trueup::alignment::camera_fit::{self, Refine, refine_camera};
use trueup::alignment::marks::find_marks;
use trueup::alignment::vision::{Options, Sighting, see};
use trueup::lab::{Lab, LabSettings, Spot};
use trueup::motion::Robot;
use trueup::twin::render::{self, ArmLook, NOTHING, TABLE, View};
use trueup::world::{Camera, Point, Scene};

use crate::kitchen;

/// The arm reaching out level over the table, rad; it hides some of it from the camera.
const REACHING: [f64; 7] =
    [-0.35, 0.95, std::f64::consts::PI, -1.75, 0.0, 1.13, std::f64::consts::FRAC_PI_2];

/// What a photograph is made to be hard with.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Kind {
    Free,
    Behind,
    ArmInView,
    Empty,
    Full,
    Dark,
    Bright,
    JarAbsent,
    CupAbsent,
}

impl Kind {
    pub(crate) const ALL: [Self; 9] = [
        Self::Free,
        Self::Behind,
        Self::ArmInView,
        Self::Empty,
        Self::Full,
        Self::Dark,
        Self::Bright,
        Self::JarAbsent,
        Self::CupAbsent,
    ];

    pub(crate) fn words(self) -> &'static str {
        match self {
            Self::Free => "anywhere",
            Self::Behind => "jar behind cup",
            Self::ArmInView => "arm in view",
            Self::Empty => "no water",
            Self::Full => "250 mL",
            Self::Dark => "dark",
            Self::Bright => "bright",
            Self::JarAbsent => "jar absent",
            Self::CupAbsent => "cup absent",
        }
    }
}

/// A place on the table: x, y in m, yaw in rad; `None` for an object that is not there.
pub(crate) type Place = Option<[f64; 3]>;

/// Draws where jar and cup stand: in reach, apart, clear of the table's edge and of the printed dots.
fn places(kind: Kind, seed: u64, scene: &Scene) -> [Place; 2] {
    let mut chance = StdRng::seed_from_u64(seed ^ (kind as u64 + 1).wrapping_mul(0x9E37_79B9));
    let mut even = |low: f64, high: f64| low + (high - low) * chance.random::<f64>();
    loop {
        let mut drawn = [[0.0; 3]; 2];
        for place in &mut drawn {
            let (radius, angle) = (even(0.40, 0.75), even(-0.9, 0.9));
            *place = [radius * angle.cos(), radius * angle.sin(), even(-0.8, 0.8)];
        }
        let [jar, cup] = &mut drawn;
        if kind == Kind::Behind {
            // Away from the camera, a little to the side.
            let (dx, dy) = (cup[0] - 1.25, cup[1]);
            let (far, side) = (even(0.13, 0.18) / dx.hypot(dy), even(-0.35, 0.35));
            jar[0] = cup[0] + far * (dx - side * dy);
            jar[1] = cup[1] + far * (dy + side * dx);
        }
        let apart = (jar[0] - cup[0]).hypot(jar[1] - cup[1]);
        let least = if kind == Kind::Behind { 0.13 } else { 0.16 };
        let clear = [*jar, *cup].iter().zip([0.046, 0.08]).all(|(place, reach)| {
            scene.table.holds(place[0], place[1], reach + 0.03)
                && place[0] > 0.30
                && scene
                    .marks
                    .iter()
                    .all(|m| (place[0] - m.x).hypot(place[1] - m.y) > reach + m.radius + 0.005)
        });
        if apart > least && clear {
            let jar = (kind != Kind::JarAbsent).then_some(*jar);
            return [jar, (kind != Kind::CupAbsent).then_some(*cup)];
        }
    }
}

/// A laboratory's photograph and what is known of it.
pub(crate) struct Photo {
    pub(crate) image: RgbImage,
    pub(crate) camera: Camera,
    pub(crate) scene: Scene,
    pub(crate) ignore: GrayImage,
    pub(crate) truth: [Place; 2],
}

/// One laboratory: its camera as aligned on the bare table, and the means to take photographs.
pub(crate) struct Bench {
    seed: u64,
    camera: Camera,
    robot: Robot,
    look: ArmLook,
}

fn settings(truth: [Place; 2], q: &[f64]) -> LabSettings {
    let mut settings = LabSettings::default();
    for (name, place) in ["jar", "cup"].into_iter().zip(truth) {
        // What is not there lies on the floor far behind the arm.
        let [x_m, y_m, yaw_rad] =
            place.unwrap_or([-4.0, if name == "jar" { 0.0 } else { 1.0 }, 0.0]);
        settings.placement.fixed.insert(name.into(), Spot { x_m, y_m, yaw_rad });
    }
    settings.start.q_rad = q.to_vec();
    settings
}

impl Bench {
    pub(crate) fn new(seed: u64) -> Self {
        let scene = kitchen::scene();
        let mut lab =
            Lab::new(&Robot::gen3(), &scene, settings([None, None], &kitchen::HOME), seed).unwrap();
        let guess = scene.camera;
        let seen = find_marks(&lab.photo(), &scene, &guess).unwrap();
        let points: Vec<_> = seen
            .iter()
            .map(|s| camera_fit::Sighting {
                point: Point::new(scene.marks[s.mark_idx].x, scene.marks[s.mark_idx].y, 0.0),
                pixel: s.pixel,
                sigma: s.sigma,
            })
            .collect();
        let camera = refine_camera(&guess, &points, &Refine::all()).unwrap().camera;
        let robot = Robot::from_urdf(kitchen::URDF, None).unwrap();
        let look = ArmLook::new(&Robot::gen3());
        Self { seed, camera, robot, look }
    }

    pub(crate) fn photo(&self, kind: Kind) -> Photo {
        let mut scene = kitchen::scene();
        let truth = places(kind, self.seed, &scene);
        let q = if kind == Kind::ArmInView { REACHING } else { kitchen::HOME };
        let mut settings = settings(truth, &q);
        match kind {
            Kind::Dark => {
                settings.light.lamp = [-0.5, -0.4];
                settings.sensor.exposure = [-0.35, -0.25];
            }
            Kind::Bright => {
                settings.light.lamp = [0.15, 0.25];
                settings.sensor.exposure = [0.1, 0.2];
            }
            _ => {}
        }
        let mut in_lab = scene.clone();
        if let Some(cavity) = &mut in_lab.objects[0].cavity {
            cavity.filled = match kind {
                Kind::Empty => 0.0,
                Kind::Full => 250e-6,
                _ => cavity.filled,
            };
        }
        let image = Lab::new(&Robot::gen3(), &in_lab, settings, self.seed).unwrap().photo();
        scene.camera = self.camera;
        Photo { image, camera: self.camera, ignore: self.arm(&scene, &q), scene, truth }
    }

    /// Where the arm hides the table, as `execution::real` has it: by its own report and a little more.
    fn arm(&self, scene: &Scene, q: &[f64]) -> GrayImage {
        let poses = self.robot.link_poses(q, self.robot.max_opening()).unwrap();
        let base: &Isometry3<f64> = scene.world_from_base.isometry();
        let links: Vec<_> = self
            .robot
            .links()
            .iter()
            .zip(poses)
            .map(|(link, pose)| (link.name.clone(), base * pose))
            .collect();
        let view = View::of_arm(scene, &self.look, &links);
        let frame = render::render(&self.camera, &view, &render::Options::quick());
        let bodies = frame.ids.iter().map(|&id| if id == NOTHING || id == TABLE { 0 } else { 255 });
        let (w, h) = (self.camera.intrinsics.width, self.camera.intrinsics.height);
        let mask = GrayImage::from_raw(w, h, bodies.collect()).unwrap();
        imageproc::morphology::dilate(&mask, imageproc::distance_transform::Norm::LInf, 12)
    }
}

impl Photo {
    pub(crate) fn see(&self) -> Vec<Sighting> {
        let options = Options { ignore: Some(self.ignore.clone()), ..Options::default() };
        see(&self.image, &self.camera, &self.scene, &options).unwrap()
    }
}

/// How far a sighting is from where the object stands: mm, and rad by the smallest symmetric turn.
pub(crate) fn off(seen: &Sighting, [x, y, yaw]: [f64; 3], symmetry: f64) -> Option<(f64, f64)> {
    let pose = seen.world_from_object?;
    let far = 1e3 * (pose.origin().x - x).hypot(pose.origin().y - y);
    let turn = if symmetry > 0.0 {
        let turn = (pose.yaw() - yaw).rem_euclid(symmetry);
        turn.min(symmetry - turn)
    } else {
        0.0
    };
    Some((far, turn))
}
