//! A goal becomes joints over time: robot model, kinematics, dynamics, planning, timing.
//!
//! [`Robot`] is read from a URDF and constant. [`ik`] turns a pose into joint positions, [`rrt`] joint
//! positions into a collision-free path through a [`collision::CollisionWorld`] by a search, [`rmpflow`] by policies, [`trajectory`] a path
//! into joints over time within their limits; [`braking`] brings them to rest out of any motion; [`giving_way`] moves on tick by tick among things that move. Nothing here knows physics beyond rigid-body torques, and
//! nothing moves an arm.
//!
//! ```
//! use trueup::motion::{Robot, ik::Solver};
//!
//! let robot = Robot::gen3();
//! let home = robot.pose("home").unwrap();
//! let target = robot.forward(home).unwrap();
//! let q = Solver::new(&robot).nearest(&target, home).unwrap();
//! let reached = robot.forward(&q).unwrap();
//! assert!((reached.origin() - target.origin()).norm() < 1e-9); // m
//! ```

mod error;
pub mod fault;
pub mod budget;
mod side;
mod bounds;
mod lacking;
mod tree;
mod mimic;
mod turn;
pub mod mesh;
mod hull;
mod cover;
mod knuckle;
mod jaw;
mod urdf;
pub mod solid;
pub mod inertial;
mod sin_cos;
mod lanes;
mod quad;
mod widest;
mod looking;
mod spheres;
mod frames;
mod steps;
mod scratch;
mod moments;
mod links;
pub mod robot;
pub mod reserve;
pub mod revise;
pub mod kinematics;
pub mod gripper;
mod linkage;
pub mod dynamics;
mod cholesky;
mod normal;
mod gate;
mod screws;
mod polish;
pub mod closed_form;
mod axes;
mod triangles;
mod window;
mod solutions;
mod descent;
mod subproblem;
mod decomposition;
mod unreached;
pub mod ik;
mod depth;
mod body;
mod distance;
mod broad;
mod posture;
mod nearest;
mod contact_pairs;
mod reach;
mod beyond;
mod frames8;
mod batch;
pub mod collision;
mod certify;
mod closest;
pub mod polyline;
mod cone;
pub mod escape;
mod motions;
mod growth;
mod led;
mod connect;
mod tauten;
mod simplify;
pub mod rrt;
mod outward;
pub mod separation;
mod rmp;
mod pullback;
pub mod rmpflow;
pub mod free;
mod curve;
mod slopes;
mod profile;
mod linear;
mod ramp;
mod passage;
mod passing;
mod looks;
mod timing;
pub mod trajectory;
pub mod braking;
pub mod sights;
pub mod giving_way;
pub mod cartesian;

pub use budget::Budget;
pub use error::Error;
pub use inertial::Inertial;
pub use robot::Robot;
pub(crate) use widest::widest;
