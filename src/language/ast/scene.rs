//! What a scene says.

use super::{Call, Expr, Literal, Name, Span};

/// `scene kitchen { … }`.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneItem {
    /// Documentation.
    pub doc: Vec<String>,
    /// Its name.
    pub name: Name,
    /// `jar: Container = cuboid(…) { … }`.
    pub things: Vec<SceneThing>,
    /// `marks dots(radius 12 mm) { (x, y) … }`: centres and radius.
    pub marks: Vec<SceneMarks>,
    /// `camera overhead { … }`.
    pub cameras: Vec<SceneCamera>,
    /// `robot gen3_2f85 at (0 m, 0 m, 0 m)`.
    pub robots: Vec<SceneRobot>,
    /// `person at (0.6 m, 0 m, 0.25 m)`: where something is handed over.
    pub people: Vec<([Literal; 3], Span)>,
    /// Where.
    pub span: Span,
}

/// `jar: Container = cuboid(65 mm, 65 mm, 140 mm) at (…) { wall 3 mm … }`.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneThing {
    /// Its name.
    pub name: Name,
    /// Its type.
    pub ty: Name,
    /// `box`, `cuboid` or `cylinder`, with arguments bare or named; `mesh` with the name of a file.
    pub shape: Call,
    /// `at (x, y[, z])`.
    pub at: Option<(Vec<Literal>, Span)>,
    /// `wall 3 mm`, `looks "…"`, `colour "#…"`, …
    pub properties: Vec<Property>,
    /// Where.
    pub span: Span,
}

/// `wall 3 mm` inside braces.
#[derive(Debug, Clone, PartialEq)]
pub struct Property {
    /// Its name.
    pub name: Name,
    /// `~`: a guess that alignment may move.
    pub guess: bool,
    /// Its value: a quantity, a text, or several.
    pub value: Vec<Expr>,
    /// Where.
    pub span: Span,
}

/// `marks dots(radius 12 mm) { (0.25 m, -0.36 m) … }`.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneMarks {
    /// Radius of each dot.
    pub radius: Literal,
    /// Centres on the table.
    pub centres: Vec<[Literal; 2]>,
    /// Where.
    pub span: Span,
}

/// `camera overhead { image 1280 x 720 focal ~ 900 px at (…) looking (…) }`.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneCamera {
    /// Its name.
    pub name: Name,
    /// What is inside it.
    pub lens: SceneLens,
    /// Where it stands.
    pub at: [Literal; 3],
    /// What it looks at.
    pub looking: [Literal; 3],
    /// Where.
    pub span: Span,
}

/// What a scene says of the inside of a camera.
#[derive(Debug, Clone, PartialEq)]
pub enum SceneLens {
    /// `image 1280 x 720  focal ~ 900 px`: a guess, to be fitted.
    Guess {
        /// Width and height, px.
        image: [u32; 2],
        /// Focal length, px.
        focal: f64,
    },
    /// `calibration "camera.json"`: known, from a file beside the scene's.
    Calibration {
        /// The file, as written.
        file: String,
        /// Where it is named.
        span: Span,
    },
}

/// `robot gen3_2f85 at (0 m, 0 m, 0 m)`.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneRobot {
    /// Its folder in `stdlib/robots/`.
    pub name: Name,
    /// Where its base stands.
    pub at: [Literal; 3],
    /// Where.
    pub span: Span,
}
