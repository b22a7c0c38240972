//! What the signs of the drawing mean, below it.

use std::fmt::Write as _;

use super::super::Role;
use super::layout::{SMALL, width_of};
use super::{Picture, TIME, escaped, stroke, wording};

impl Picture<'_> {
    pub(super) fn legend(&mut self) {
        let y = self.layout.height - 30.0;
        let mut x = 24.0;
        let mut item = |out: &mut String, mark: &dyn Fn(f64) -> String, said: &str| {
            out.push_str(&mark(x));
            let _ = writeln!(
                out,
                "<text x=\"{:.1}\" y=\"{:.1}\" font-size=\"{SMALL}\" fill=\"#333\">{}</text>",
                x + 36.0,
                y + 4.0,
                escaped(said)
            );
            x += 36.0 + width_of(said, 11.0) + 22.0;
        };
        let swatch = |style: &'static str| {
            move |x: f64| {
                format!(
                    "<rect x=\"{x:.1}\" y=\"{:.1}\" width=\"28\" height=\"16\" {style}/>\n",
                    y - 8.0
                )
            }
        };
        let line = |role: Role| {
            move |x: f64| {
                let (colour, dash, marker) = stroke(role);
                let arrow = if role == Role::Gives {
                    format!("marker-end=\"url(#{marker})\"")
                } else {
                    String::new()
                };
                format!(
                    "<path d=\"M{x:.1} {y:.1} H{:.1}\" stroke=\"{colour}\" stroke-width=\"1.6\" {dash} {arrow}/>\n",
                    x + 28.0
                )
            }
        };
        let out = &mut self.out;
        item(out, &swatch("rx=\"6\" fill=\"#cfe2f3\" stroke=\"#2f5f8f\""), wording::AND);
        let diamond = move |x: f64| {
            format!(
                "<path d=\"M{x:.1} {y:.1} l8 -8 h12 l8 8 l-8 8 h-12 z\" fill=\"#fff3cf\" stroke=\"#a67c00\" \
                 stroke-dasharray=\"5 3\"/>\n"
            )
        };
        item(out, &diamond, wording::OR);
        item(out, &swatch("fill=\"#fff\" stroke=\"#333\""), wording::ACTION);
        item(out, &swatch("fill=\"#eaf4fb\" stroke=\"#0063a0\""), wording::CHECK);
        let recovery =
            swatch("rx=\"6\" fill=\"#f7dcdc\" stroke=\"#a04040\" stroke-dasharray=\"5 3\"");
        item(out, &recovery, wording::RECOVERY);
        let oval = move |x: f64| {
            let cx = x + 14.0;
            format!(
                "<ellipse cx=\"{cx:.1}\" cy=\"{y:.1}\" rx=\"14\" ry=\"8\" fill=\"#e9f5e4\" stroke=\"#5c8a5c\"/>\n"
            )
        };
        item(out, &oval, wording::FLUENT);
        for role in [Role::Needs, Role::Keeps, Role::Gives, Role::Checks, Role::Until] {
            item(out, &line(role), role.word());
        }
        let time = move |x: f64| {
            format!(
                "<path d=\"M{x:.1} {y:.1} H{:.1}\" stroke=\"{TIME}\" stroke-width=\"1.3\" marker-end=\"url(#time)\"/>\n",
                x + 28.0
            )
        };
        item(out, &time, wording::TIME);
    }
}
