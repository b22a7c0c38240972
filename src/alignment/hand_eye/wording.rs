//! What to say of an answer beside its numbers: what is doubtful, and which picture to take next.

use std::fmt;

use nalgebra::Vector3;

use super::types::{HandEye, Mount, Noise, Square};

/// Something that a person should know or do. Lengths in m, angles in rad.
#[derive(Debug, Clone, PartialEq)]
pub enum Advice {
    /// The squares are of another size than was said.
    Square(Square),
    /// The camera is where none would be, and mounted the other way with the poses inverted it would be where one is: `G X = Y B` of
    /// a camera on the wrist is that of a fixed one with `G` inverted, so that no picture tells them apart.
    Inverse {
        /// Where the camera was found to be mounted.
        mount: Mount,
        /// Its distance from the origin of the frame that it is fixed to.
        distance: f64,
    },
    /// A picture that was left out.
    LeftOut {
        /// Its name.
        picture: String,
        /// What it is off by.
        rotation: f64,
        /// What it is off by.
        position: f64,
        /// The picture whose row of the table fits it.
        row_of: Option<String>,
    },
    /// Few pictures.
    Few {
        /// How many were used.
        pictures: usize,
    },
    /// The wrist turned little about an axis.
    Turn {
        /// Where the camera is mounted.
        mount: Mount,
        /// The axis, in the frame that the camera is fixed to.
        axis: Vector3<f64>,
        /// How far it turned, rms.
        turned: f64,
    },
    /// The camera's place is loosely held along an axis.
    Unsure {
        /// Where the camera is mounted.
        mount: Mount,
        /// The axis, 0 to 2, of the frame that the camera is fixed to.
        axis: usize,
        /// Standard deviation along it.
        std: f64,
    },
    /// The robot's poses, not the corners, limit the answer.
    Poses {
        /// Noise of the robot's poses along one axis.
        rotation: f64,
        /// The same.
        position: f64,
    },
}

/// Fewer pictures than this are few: the noise is taken from them. Chosen: ten, as makers of arms and cameras ask for.
const FEW: usize = 10;
/// A place less sure than this is said to be, m. Chosen: what a gripper forgives.
const UNSURE: f64 = 0.005;
/// Poses that are worse than this are said to be, rad and m. Chosen: 0.2 deg and 1 mm, some times what makers of arms promise.
const ROUGH: (f64, f64) = (3.5e-3, 1e-3);
/// Nearer to the base's origin than this, m, is the arm itself, no fixed camera. Chosen: bases of arms are 0.1 to 0.2 m wide.
const BASE: f64 = 0.2;
/// No hand carries a camera farther from the flange than this, m. Chosen: cameras sit at 0.05 to 0.2 m.
const HAND: f64 = 0.5;

impl HandEye {
    /// Returns what is doubtful and what the next pictures should show, most important first.
    pub fn advice(&self) -> Vec<Advice> {
        let mut advice = Vec::new();
        if self.square.is_wrong {
            advice.push(Advice::Square(self.square));
        }
        advice.extend(self.inverse());
        for view in self.views.iter().filter(|v| !v.is_used) {
            advice.push(Advice::LeftOut {
                picture: view.name.clone(),
                rotation: view.rotation,
                position: view.position,
                row_of: view.row_of.map(|i| self.views[i].name.clone()),
            });
        }
        if let Some((axis, turned)) = self.motions.wanting() {
            advice.push(Advice::Turn { mount: self.mount, axis, turned });
        }
        let std = self.camera.std_position;
        let axis = std.imax();
        if std[axis] > UNSURE {
            advice.push(Advice::Unsure { mount: self.mount, axis, std: std[axis] });
        }
        let pictures = self.views.iter().filter(|v| v.is_used).count();
        if pictures < FEW {
            advice.push(Advice::Few { pictures });
        }
        if self.noise.rotation > ROUGH.0 || self.noise.position > ROUGH.1 {
            let Noise { rotation, position } = self.noise;
            advice.push(Advice::Poses { rotation, position });
        }
        advice
    }

    /// Whether the poses seem to be inverted, if nobody said where the camera is.
    fn inverse(&self) -> Option<Advice> {
        let is_tried = self.other_mount.is_some();
        let distance = self.camera.pose.translation.vector.norm();
        let is_odd = match self.mount {
            Mount::Wrist => distance > HAND,
            Mount::Fixed => distance < BASE,
        };
        (is_tried && is_odd).then_some(Advice::Inverse { mount: self.mount, distance })
    }
}

impl Advice {
    /// Returns whether the calibration should not be used before this is mended.
    pub fn is_warning(&self) -> bool {
        matches!(self, Self::Square(_) | Self::Inverse { .. } | Self::LeftOut { .. })
    }
}

impl fmt::Display for Advice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Square(square) => write!(
                f,
                "by the robot's travel the {} look like {:.2} ± {:.2} mm, not {:.2} mm; that size was used. Measure ten of \
                 them with a ruler and say what they are; if they are as said, the robot's lengths are off by {:.1} %",
                square.of,
                1e3 * square.measured,
                1e3 * square.std,
                1e3 * square.said,
                100.0 * (square.said / square.measured - 1.0).abs()
            ),
            Self::Inverse { mount, distance } => {
                let (odd, other) = match mount {
                    Mount::Wrist => ("farther than a hand carries one", "a fixed camera"),
                    Mount::Fixed => ("where the arm itself stands", "a camera on the wrist"),
                };
                write!(
                    f,
                    "the camera is {:.0} mm from the origin of the {}, {odd}; {other} and a table of inverse poses \
                     (flange_from_base) look the same. If it is there say `--camera {}`, otherwise invert the poses",
                    1e3 * distance,
                    mount.carrier(),
                    mount.name()
                )
            }
            Self::LeftOut { picture, rotation, position, row_of } => {
                write!(
                    f,
                    "{picture} was left out: its pose is {:.1} deg and {:.1} mm off what the others say",
                    rotation.to_degrees(),
                    1e3 * position
                )?;
                match row_of {
                    Some(other) => write!(f, "; the row of {other} fits it: are rows exchanged?"),
                    None => write!(f, "; did the robot or the board move before it was taken?"),
                }
            }
            Self::Few { pictures } => write!(
                f,
                "only {pictures} pictures; take {} or more, the wrist turned by 20 to 40 deg to another side in each",
                FEW.max(pictures + 1) - pictures
            ),
            Self::Turn { mount, axis, turned } => write!(
                f,
                "the wrist turned by {:.0} deg only about ({:.2}, {:.2}, {:.2}) in the {} frame; take pictures turned by 20 to \
                 40 deg about it",
                turned.to_degrees(),
                axis.x,
                axis.y,
                axis.z,
                mount.carrier()
            ),
            Self::Unsure { mount, axis, std } => write!(
                f,
                "the camera's place along {} of the {} frame is known to ± {:.1} mm only; take more pictures, turned about \
                 the other two axes",
                ["x", "y", "z"][*axis],
                mount.carrier(),
                1e3 * std
            ),
            Self::Poses { rotation, position } => write!(
                f,
                "the robot's poses are off by {:.2} deg and {:.1} mm an axis, which limits the answer, not the corners: is \
                 the arm calibrated, did it stand still, are board and camera tight?",
                rotation.to_degrees(),
                1e3 * position
            ),
        }
    }
}
