//! What exactly is wrong behind an [`Error`](super::Error): with a URDF, a side file, a path or its times.
//!
//! Positions are in m or rad, masses in kg, as the variants say.

use crate::world::mesh::read;

/// Why a text is no robot this program can use.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum UrdfFault {
    /// A text from which a URDF is made.
    #[error("it is written in xacro, from which a URDF is made")]
    Xacro,
    /// It is not the format at all: what its reader said.
    #[error("{0}")]
    Format(String),
    /// It is of a robot, and something in it cannot be read: what its reader said.
    #[error("{0}")]
    Content(String),
    /// It is of a robot, and something stands where it cannot be.
    #[error("{found} stands where it cannot be read")]
    OutOfPlace {
        /// An element or its end, as it is written, or a text.
        found: String,
    },
    /// An element lacks what it needs, an attribute or an element inside.
    #[error("{0}")]
    Lacks(Box<Lacking>),
    /// Elements inside elements inside elements.
    #[error("its elements are nested more than {most} deep")]
    TooDeep {
        /// As deep as they may be.
        most: usize,
    },
    /// More links than any robot has.
    #[error("it has more than {most} links")]
    TooManyLinks {
        /// As many as it may have.
        most: usize,
    },
    /// A folder that does not say which robot is meant.
    #[error("{folder} has several files that end in .urdf: name one")]
    SeveralFiles {
        /// The folder.
        folder: String,
    },
    /// Nothing to build.
    #[error("it has no <link>")]
    NoLink,
    /// An element that is needed and not there: which, and of what.
    #[error("it has no {what} {name}")]
    Missing {
        /// The element.
        what: String,
        /// Its name, or what it is part of.
        name: String,
    },
    /// Two links of one name.
    #[error("two links are named {name}")]
    SameName {
        /// The name.
        name: String,
    },
    /// Two joints of one name.
    #[error("two joints are named {name}")]
    SameJoint {
        /// The name.
        name: String,
    },
    /// A joint to nowhere.
    #[error("joint {joint} names a link {link}, which does not exist")]
    NoSuchLink {
        /// The joint.
        joint: String,
        /// The link it names.
        link: String,
    },
    /// A link with two parents.
    #[error(
        "link {link} hangs on two joints, {first} and {second}: closed loops are not supported"
    )]
    TwoParents {
        /// The link.
        link: String,
        /// The joint listed first.
        first: String,
        /// The other.
        second: String,
    },
    /// No link to begin with.
    #[error("every link has a parent: the joints form a loop")]
    NoRoot,
    /// Two links to begin with.
    #[error("links {first} and {second} both have no parent: the links do not form one tree")]
    TwoRoots {
        /// One of them.
        first: String,
        /// The other.
        second: String,
    },
    /// Joints that cannot be reached from the root.
    #[error("some joints form a loop that hangs on nothing")]
    LooseLoop,
    /// A joint that follows nobody.
    #[error("joint {joint} mimics {master}, which does not exist")]
    NoMaster {
        /// The joint.
        joint: String,
        /// Which it should follow.
        master: String,
    },
    /// A joint that follows itself.
    #[error("joint {joint} mimics itself")]
    FollowsItself {
        /// The joint.
        joint: String,
    },
    /// Joints of which none leads.
    #[error("joints {} mimic each other in a circle", joints.join(", "))]
    Circle {
        /// The joints: each follows the next, and the last the first.
        joints: Vec<String>,
    },
    /// A kind of joint nothing here can move.
    #[error(
        "joint {joint} is {kind:?}; only fixed, revolute, continuous and prismatic joints are known"
    )]
    JointKind {
        /// The joint.
        joint: String,
        /// Its kind.
        kind: urdf_rs::JointType,
    },
    /// A joint that moves about or along nothing.
    #[error("joint {joint} has no axis")]
    NoAxis {
        /// The joint.
        joint: String,
    },
    /// A range upside down.
    #[error("joint {joint}: its lower limit {lower} is above its upper {upper}")]
    Range {
        /// The joint.
        joint: String,
        /// rad or m.
        lower: f64,
        /// rad or m.
        upper: f64,
    },
    /// NaN or infinity in an origin.
    #[error("joint {joint}: its origin is not finite")]
    Origin {
        /// The joint.
        joint: String,
    },
    /// A mass below 0, or none that is a number.
    #[error("link {link}: its mass is {mass} kg")]
    Mass {
        /// The link.
        link: String,
        /// kg.
        mass: f64,
    },
    /// A collision shape that encloses nothing.
    #[error("link {link}: the {side} of its collision {shape} is {size} m")]
    Size {
        /// The link.
        link: String,
        /// What it is: a box, a sphere.
        shape: &'static str,
        /// Which of its sizes.
        side: &'static str,
        /// m.
        size: f64,
    },
    /// A joint that nothing resists.
    #[error("a joint carries no mass, so its acceleration is undefined")]
    Massless,
    /// A change that would take all mass away.
    #[error("its link {link} would weigh {mass:.3} kg")]
    WouldWeigh {
        /// The link.
        link: String,
        /// kg.
        mass: f64,
    },
    /// A text whose numbers are written in ways that cannot be changed one by one.
    #[error("its numbers cannot be changed without changing others")]
    Entangled,
}

/// An element that lacks what it needs.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("line {line}: {} has no {field}", said_of_element(element, part, name))]
pub struct Lacking {
    /// The element.
    pub element: String,
    /// What it lacks.
    pub field: String,
    /// What it is part of, or is: a link, a joint, a material, the robot.
    pub part: String,
    /// Its name; empty without one.
    pub name: String,
    /// The line on which the element begins.
    pub line: usize,
}

/// Words an element by what it is part of.
fn said_of_element(element: &str, part: &str, name: &str) -> String {
    match (element == part, name) {
        (true, "") => format!("<{element}>"),
        (true, name) => format!("<{element}> {name}"),
        (false, name) => format!("<{element}> of {part} {name}"),
    }
}

/// What is wrong with the file beside a URDF.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum SideFault {
    /// It is not the format at all: what its reader said.
    #[error("{0}")]
    Format(String),
    /// A marker that is not fixed to the hand.
    #[error("marker: {link} moves with the jaws")]
    MarkerMoves {
        /// The link it is on.
        link: String,
    },
    /// A marker of no size or nowhere.
    #[error("marker: centre_m and radius_m must be finite, the radius positive")]
    MarkerNumbers,
    /// A tool centre point nowhere.
    #[error("tool: xyz_m and rpy_deg must be finite")]
    ToolNumbers,
    /// A link that the URDF does not have.
    #[error("{key}: the robot has no link {name}; it has {}", known.join(", "))]
    NoLink {
        /// Under which key it is named.
        key: &'static str,
        /// What it is called there.
        name: String,
        /// What there is.
        known: Vec<String>,
    },
    /// Limits that are none, or too few.
    #[error("{key} needs {joints} positive numbers")]
    JointLimits {
        /// Their key in the file.
        key: &'static str,
        /// How many joints there are.
        joints: usize,
    },
    /// A pose that leaves joints out, or speaks of joints that are not there.
    #[error("pose {name} has {angles} angles; the arm has {joints} joints")]
    PoseLength {
        /// The pose.
        name: String,
        /// How many angles it has.
        angles: usize,
        /// How many joints there are.
        joints: usize,
    },
}

/// Why a search found no path.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum NoWay {
    /// The samples were used up.
    #[error("the trees from start and goal hold {start} and {goal} configurations and never met")]
    NeverMet {
        /// Configurations reached from the start.
        start: usize,
        /// Configurations reached from the goals.
        goal: usize,
    },
    /// A reactive motion found its balance before its goal.
    #[error(
        "the motion came to rest {left_mm} mm and {joints_deg} deg of its joints before its goal"
    )]
    CameToRest {
        /// How far the tip is from its target, mm.
        left_mm: u32,
        /// How far the joints are from the goal, deg (Euclidean).
        joints_deg: u32,
    },
    /// A reactive motion that touches something, or comes too near.
    #[error("the motion grazes something")]
    Grazes,
    /// A reactive motion that used up the budget.
    #[error(
        "the motion was on its way when the budget of about {seconds} s of computing was spent"
    )]
    OnItsWay {
        /// What the budget is on the machine this was written on, s.
        seconds: u64,
    },
}

/// What stops a motion of the tip along a line or about a point.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Stop {
    /// No joint position is near that puts the tip there.
    #[error("the arm is stretched out or singular there")]
    Singular,
    /// A joint would leave its range.
    #[error("{joint} is at its limit")]
    AtLimit {
        /// Which joint.
        joint: String,
    },
    /// A joint would move too far from one point to the next.
    #[error("{joint} would have to jump")]
    Jump {
        /// Which joint.
        joint: String,
    },
    /// One joint after the other was held at the end of its range.
    #[error("too many joints are at their limits")]
    AllAtLimits,
}

/// Why points do not make a trajectory.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Untimed {
    /// Points and times do not go together.
    #[error("it takes as many times as points, at least two")]
    Counts,
    /// Time stands still or runs back.
    #[error("times must increase")]
    Times,
    /// Points of several lengths, or with numbers that are none.
    #[error("points must be finite and of one length")]
    Points,
    /// Two motions that do not meet.
    #[error("the next one begins {gap:.6} rad from where this one ends")]
    Gap {
        /// How far apart they are, rad.
        gap: f64,
    },
    /// Nothing to go along.
    #[error("the path has no points")]
    Empty,
    /// Points of another arm, or with numbers that are none.
    #[error("every point needs one finite number per joint")]
    Joints,
    /// Limits that limit nothing, or too few.
    #[error("every joint needs a positive limit of speed, acceleration and jerk")]
    Limits,
}

/// Why a mesh is none.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum MeshFault {
    /// No such file.
    #[error("it is not found beside the URDF or in a folder of its package above it")]
    Missing,
    /// A file that cannot be read.
    #[error("it cannot be read: {0}")]
    Unread(String),
    /// A file that nobody asked for.
    #[error("nothing is asked that it would tell")]
    NotAsked,
    /// Bytes that are no mesh.
    #[error(transparent)]
    Read(#[from] read::Unread),
}

/// What was assumed or left out while a URDF was read.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Note {
    /// A mesh that could not be used.
    #[error("link {link}: the mesh {file} is left out: {what}")]
    Mesh {
        /// The link.
        link: String,
        /// The mesh, as the URDF names it.
        file: String,
        /// What is wrong with it.
        what: MeshFault,
    },
    /// Jaws on knuckles, taken as sliding ones.
    #[error(
        "the jaws turn on coupled knuckles and open {}; they are taken as sliding, and come forward by {advance_mm} mm that are left out",
        said_of_opening(*least_mm, *opening_mm)
    )]
    Coupled {
        /// How wide they are open at least, mm.
        least_mm: u32,
        /// How wide they open, mm.
        opening_mm: u32,
        /// How far they come forward while they close, mm.
        advance_mm: u32,
    },
    /// A joint that may go anywhere.
    #[error("joint {joint} has no position limits")]
    NoRange {
        /// The joint.
        joint: String,
    },
    /// A joint of unknown speed.
    #[error("joint {joint} has no speed limit; 1 rad/s is used")]
    NoSpeed {
        /// The joint.
        joint: String,
    },
    /// A joint that nobody drives.
    #[error("joint {joint} is not on the way to the tip; it stays put")]
    OffPath {
        /// The joint.
        joint: String,
    },
}

/// Words how wide jaws open, from where they are nearest to each other, mm.
pub fn said_of_opening(least: u32, most: u32) -> String {
    if least == 0 { format!("{most} mm") } else { format!("{least} to {most} mm") }
}
