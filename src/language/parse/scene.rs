//! The grammar's pairs → scenes, twins and their entries.
//!
//! Only the shape of the text is read here; whether a cup may have a negative wall is
//! `world::scene`'s question.

use super::super::ast::{
    Arg, Call, EffectItem, EffectParameter, Expr, ExprKind, Literal, Name, Property, SceneCamera,
    SceneItem, SceneLens, SceneMarks, SceneRobot, SceneThing, Span, TwinItem,
};
use super::super::diagnostic::Diagnostic;
use super::build::{Builder, find, number, unquote};
use super::expression::no_name;
use super::grammar::{Pair, Place, Rule};
use crate::units::Dimension;

impl Builder<'_> {
    /// Reads `scene name { … }`.
    pub(super) fn scene<'i>(
        &mut self,
        doc: Vec<String>,
        inner: impl Iterator<Item = Pair<'i>>,
        span: Span,
    ) -> SceneItem {
        let mut item = SceneItem {
            doc,
            name: no_name(span),
            things: Vec::new(),
            marks: Vec::new(),
            cameras: Vec::new(),
            robots: Vec::new(),
            people: Vec::new(),
            span,
        };
        for pair in inner {
            match pair.as_rule() {
                Rule::id => item.name = self.name(&pair),
                Rule::thing => item.things.extend(self.thing(&pair)),
                Rule::marks => item.marks.extend(self.marks(&pair)),
                Rule::camera => item.cameras.extend(self.camera(&pair)),
                Rule::robot => item.robots.extend(self.robot(&pair)),
                Rule::person => {
                    let span = self.span(&pair);
                    item.people.extend(self.place(&pair).map(|at| (at, span)));
                }
                Rule::bad_entry => {
                    self.bad(&pair, Place::Entry);
                }
                _ => {}
            }
        }
        item
    }

    fn thing(&mut self, pair: &Pair) -> Option<SceneThing> {
        let mut ids = pair.clone().into_inner().filter(|p| p.as_rule() == Rule::id);
        let (name, ty) = (self.name(&ids.next()?), self.name(&ids.next()?));
        let shape = self.shape(&find(pair, Rule::shape)?)?;
        let at = find(pair, Rule::place).and_then(|place| {
            let point = find(&place, Rule::point)?;
            Some((self.point(&point), self.span(&point)))
        });
        let mut properties = Vec::new();
        for part in find(pair, Rule::properties).into_iter().flat_map(Pair::into_inner) {
            match part.as_rule() {
                Rule::property => properties.extend(self.property(&part)),
                Rule::bad_entry => {
                    self.bad(&part, Place::Property);
                }
                _ => {}
            }
        }
        Some(SceneThing { name, ty, shape, at, properties, span: self.span(pair) })
    }

    /// `cuboid(65 mm, 65 mm, 140 mm)`, `cylinder(radius 80 mm, height 95 mm)`, `mesh "bracket.stl"`.
    fn shape(&mut self, pair: &Pair) -> Option<Call> {
        if let (Some(word), Some(file)) = (find(pair, Rule::K_mesh), find(pair, Rule::text)) {
            let span = self.span(&file);
            let value = Expr { kind: ExprKind::Text(unquote(file.as_str())), span };
            let name = Name { text: word.as_str().to_owned(), span: self.span(&word) };
            let args = vec![Arg { name: None, values: vec![value], span }];
            return Some(Call { name, args, span: self.span(pair) });
        }
        let name = self.name(&find(pair, Rule::id)?);
        let mut args = Vec::new();
        for part in pair.clone().into_inner() {
            match part.as_rule() {
                Rule::extent => {
                    let value = self.signed(&find(&part, Rule::signed)?);
                    let name = find(&part, Rule::id).map(|p| self.name(&p));
                    args.push(Arg {
                        name,
                        values: vec![literal_expr(value)],
                        span: self.span(&part),
                    });
                }
                Rule::bad_args => self.bad_list(pair, &part, Place::Extents),
                _ => {}
            }
        }
        Some(Call { name, args, span: self.span(pair) })
    }

    fn property(&mut self, pair: &Pair) -> Option<Property> {
        let name = self.name(&find(pair, Rule::id)?);
        let mut value = Vec::new();
        for part in pair.clone().into_inner() {
            let span = self.span(&part);
            match part.as_rule() {
                Rule::text => {
                    value.push(Expr { kind: ExprKind::Text(unquote(part.as_str())), span });
                }
                Rule::K_true | Rule::K_false => {
                    let kind = ExprKind::Bool(part.as_rule() == Rule::K_true);
                    value.push(Expr { kind, span });
                }
                Rule::signed => value.push(literal_expr(self.signed(&part))),
                Rule::point => value.extend(self.point(&part).into_iter().map(literal_expr)),
                _ => {}
            }
        }
        let guess = find(pair, Rule::guess).is_some();
        Some(Property { name, guess, value, span: self.span(pair) })
    }

    fn marks(&mut self, pair: &Pair) -> Option<SceneMarks> {
        let radius = self.signed(&find(pair, Rule::signed)?);
        let mut ids = pair.clone().into_inner().filter(|p| p.as_rule() == Rule::id).skip(1);
        if let Some(id) = ids.next().filter(|id| id.as_str() != "radius") {
            self.diagnostics.push(
                Diagnostic::error(
                    "task::unknown_name",
                    self.span(&id),
                    format!("marks have no `{}`", id.as_str()),
                    "expected `radius`",
                )
                .help("write `marks dots(radius 12 mm) { (x, y) … }`"),
            );
        }
        let mut centres = Vec::new();
        for part in pair.clone().into_inner() {
            match part.as_rule() {
                Rule::point => {
                    let span = self.span(&part);
                    let point = self.point(&part);
                    match <[Literal; 2]>::try_from(point) {
                        Ok(centre) => centres.push(centre),
                        Err(point) => self.wrong_point(span, point.len(), "2 coordinates, x and y"),
                    }
                }
                Rule::bad_entry => {
                    self.bad(&part, Place::Point);
                }
                _ => {}
            }
        }
        Some(SceneMarks { radius, centres, span: self.span(pair) })
    }

    fn camera(&mut self, pair: &Pair) -> Option<SceneCamera> {
        let span = self.span(pair);
        let name = self.name(&find(pair, Rule::id)?);
        let (mut image, mut focal, mut file) = (None, None, None);
        let (mut at, mut looking) = (None, None);
        // What could not be read may be what is missing.
        let mut is_read = true;
        for part in pair.clone().into_inner() {
            match part.as_rule() {
                Rule::picture => {
                    let mut sides = part.clone().into_inner().filter(|p| p.as_rule() == Rule::num);
                    let (Some(w), Some(h)) = (sides.next(), sides.next()) else { continue };
                    image = Some([self.pixels(&w), self.pixels(&h)]);
                }
                Rule::focal => focal = find(&part, Rule::signed).map(|p| self.signed(&p)),
                Rule::calibration => {
                    file = find(&part, Rule::text).map(|p| (unquote(p.as_str()), self.span(&p)));
                }
                Rule::place => at = self.place(&part),
                Rule::looking => looking = self.place(&part),
                Rule::bad_entry => {
                    self.bad(&part, Place::View);
                    is_read = false;
                }
                _ => {}
            }
        }
        let lens = match (file, image, focal) {
            (Some((file, span)), None, None) => Some(SceneLens::Calibration { file, span }),
            (Some((_, span)), ..) => {
                self.told_twice(span);
                return None;
            }
            (None, Some(image), Some(focal)) => {
                let focal = self.focal(&focal)?;
                Some(SceneLens::Guess { image, focal })
            }
            _ => None,
        };
        let missing: Vec<&str> = [
            ("image 1280 x 720", lens.is_none() && image.is_none()),
            ("focal ~ 900 px", lens.is_none() && focal.is_none()),
            ("at (1.2 m, 0 m, 0.9 m)", at.is_none()),
            ("looking (0.6 m, 0 m, 0 m)", looking.is_none()),
        ]
        .iter()
        .filter_map(|(what, is_missing)| is_missing.then_some(*what))
        .collect();
        let (Some(lens), Some(at), Some(looking)) = (lens, at, looking) else {
            if is_read && !self.balanced.mended(span) {
                self.diagnostics.push(
                    Diagnostic::error(
                        "task::missing",
                        name.span,
                        format!("the camera `{}` is not complete", name.text),
                        "some of it is missing",
                    )
                    .help(format!("add `{}`", missing.join("`, `"))),
                );
            }
            return None;
        };
        Some(SceneCamera { name, lens, at, looking, span })
    }

    /// Returns a focal length, px.
    fn focal(&mut self, focal: &Literal) -> Option<f64> {
        if matches!(focal.quantity.dimension, Dimension::PIXEL) {
            return Some(focal.quantity.value);
        }
        self.diagnostics.push(
            Diagnostic::error(
                "task::unit",
                focal.span,
                format!("a focal length is given in pixels, not as {}", focal.quantity),
                "expected px",
            )
            .help("write it as `900 px`: focal length over the width of one pixel"),
        );
        None
    }

    /// Tells of a calibration beside what it says.
    fn told_twice(&mut self, calibration: Span) {
        self.diagnostics.push(
            Diagnostic::error(
                "task::argument",
                calibration,
                "a calibration says what `image` and `focal` guess",
                "both are given",
            )
            .help("remove `image` and `focal`: the file has both, and the lens"),
        );
    }

    fn robot(&mut self, pair: &Pair) -> Option<SceneRobot> {
        let span = self.span(pair);
        let name = self.name(&find(pair, Rule::id)?);
        let zero = Literal { quantity: crate::units::Quantity::metres(0.0), span };
        let at = match find(pair, Rule::point) {
            Some(_) => self.place(pair)?,
            None => [zero; 3],
        };
        Some(SceneRobot { name, at, span })
    }

    /// Reads the point inside a pair as three coordinates.
    fn place(&mut self, pair: &Pair) -> Option<[Literal; 3]> {
        let point = find(pair, Rule::point)?;
        let span = self.span(&point);
        match <[Literal; 3]>::try_from(self.point(&point)) {
            Ok(at) => Some(at),
            Err(point) => {
                self.wrong_point(span, point.len(), "3 coordinates, x, y and z");
                None
            }
        }
    }

    fn wrong_point(&mut self, span: Span, n: usize, expected: &str) {
        self.diagnostics.push(
            Diagnostic::error(
                "task::point",
                span,
                format!("this point has {n} coordinates"),
                format!("expected {expected}"),
            )
            .help("x points away from the robot, y to its left, z up; the table top is z = 0"),
        );
    }

    fn point(&mut self, pair: &Pair) -> Vec<Literal> {
        pair.clone()
            .into_inner()
            .filter(|p| p.as_rule() == Rule::signed)
            .map(|p| self.signed(&p))
            .collect()
    }

    /// Reads `-0.36 m`.
    pub(super) fn signed(&mut self, pair: &Pair) -> Literal {
        let span = self.span(pair);
        let Some(quant) = find(pair, Rule::quant) else {
            return Literal { quantity: crate::units::Quantity::default(), span };
        };
        let mut literal = self.literal(&quant);
        if find(pair, Rule::minus).is_some() {
            literal.quantity.value = -literal.quantity.value;
        }
        Literal { span, ..literal }
    }

    fn pixels(&mut self, pair: &Pair) -> u32 {
        let value = number(pair.as_str());
        if value.fract() == 0.0 && (1.0..=20_000.0).contains(&value) {
            return value as u32;
        }
        self.diagnostics.push(
            Diagnostic::error(
                "task::count",
                self.span(pair),
                format!("`{}` is not a number of pixels", pair.as_str()),
                "a whole number from 1 to 20000 stands here",
            )
            .help("write the width and height of its pictures: `image 1280 x 720`"),
        );
        1
    }

    /// Reads `twin name of scene { effect … }`.
    pub(super) fn twin<'i>(
        &mut self,
        doc: Vec<String>,
        inner: impl Iterator<Item = Pair<'i>>,
        span: Span,
    ) -> TwinItem {
        let mut names: Vec<Name> = Vec::new();
        let mut effects = Vec::new();
        for pair in inner {
            match pair.as_rule() {
                Rule::id => names.push(self.name(&pair)),
                Rule::effect => effects.extend(self.effect(&pair)),
                Rule::bad_entry => {
                    self.bad(&pair, Place::Effect);
                }
                _ => {}
            }
        }
        let mut names = names.into_iter();
        let name = names.next().unwrap_or_else(|| no_name(span));
        let of = names.next().unwrap_or_else(|| no_name(span));
        TwinItem { doc, name, of, effects, span }
    }

    fn effect(&mut self, pair: &Pair) -> Option<EffectItem> {
        let mut ids = pair.clone().into_inner().filter(|p| p.as_rule() == Rule::id);
        let (name, at) = (self.name(&ids.next()?), self.name(&ids.next()?));
        let mut parameters = Vec::new();
        for part in pair.clone().into_inner() {
            match part.as_rule() {
                Rule::effect_parameter => {
                    let mut values =
                        part.clone().into_inner().filter(|p| p.as_rule() == Rule::signed);
                    let name = self.name(&find(&part, Rule::id)?);
                    let value = self.signed(&values.next()?);
                    let std = values.next().map(|p| self.signed(&p));
                    if let Some(std) = std
                        && std.quantity.dimension != value.quantity.dimension
                    {
                        self.diagnostics.push(
                            Diagnostic::error(
                                "task::unit",
                                std.span,
                                format!(
                                    "`{}` is {}, its uncertainty {}",
                                    name.text,
                                    value.quantity.dimension.words(),
                                    std.quantity.dimension.words()
                                ),
                                "a different unit",
                            )
                            .help("give the value and what stands after `+-` in one unit"),
                        );
                    }
                    parameters.push(EffectParameter { name, value, std });
                }
                Rule::bad_entry => {
                    self.bad(&part, Place::Parameter);
                }
                _ => {}
            }
        }
        Some(EffectItem { name, at, parameters, span: self.span(pair) })
    }
}

fn literal_expr(literal: Literal) -> Expr {
    Expr { kind: ExprKind::Literal(literal.quantity), span: literal.span }
}
