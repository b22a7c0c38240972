//! The graph as an SVG picture that a person can read.
//!
//! The tree grows from left to right, time runs from top to bottom, and the fluents stand in a column at
//! the right with what they need, keep and give. With a parse graph given, what it takes is drawn in full
//! colour and the rest fades. Nothing outside the file is referred to, so it opens anywhere.

mod layout;
mod legend;
mod wording;

use std::fmt::Write as _;

use super::{
    Decides, Does, Form, Graph, Node, NodeId, NodeKind, Outcomes, ParseGraph, Priors, Relation,
    Role,
};
use crate::language::ast::Allen;
use crate::language::text;
use layout::{Box, Layout, SMALL, shorten};

/// What to draw beside the graph itself.
#[derive(Debug, Clone, Copy, Default)]
pub struct Drawing<'a> {
    /// What of it is carried out: drawn in full, the rest faded.
    pub parse: Option<&'a ParseGraph>,
    /// What came of earlier runs, and whose: `"twin"` or `"real"`.
    pub outcomes: Option<(&'a Outcomes, &'a str)>,
    /// Priors from demonstrations.
    pub priors: Option<&'a Priors>,
}

/// Colours that stay apart for people who see red and green alike (Okabe and Ito's palette).
const NEEDS: &str = "#b35900";
const KEEPS: &str = "#8a4f9e";
const GIVES: &str = "#00795a";
const CHECKS: &str = "#0063a0";
const TIME: &str = "#8c8c8c";
/// What a parse graph leaves out.
const FADED: &str = " opacity=\"0.28\"";

/// Returns the picture as the text of an SVG file.
pub fn to_svg(graph: &Graph, drawing: &Drawing<'_>) -> String {
    let layout = Layout::of(graph);
    let mut picture = Picture { graph, drawing, layout: &layout, out: String::new() };
    picture.open();
    picture.tree();
    picture.temporal();
    picture.causal();
    for node in graph.nodes() {
        picture.node(node);
    }
    picture.fluents();
    picture.legend();
    picture.out.push_str("</svg>\n");
    picture.out
}

struct Picture<'a> {
    graph: &'a Graph,
    drawing: &'a Drawing<'a>,
    layout: &'a Layout,
    out: String,
}

impl Picture<'_> {
    fn open(&mut self) {
        let (w, h) = (self.layout.width, self.layout.height);
        let title = escaped(&text::call(&self.graph.call));
        let _ = write!(
            self.out,
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{w:.0}\" height=\"{h:.0}\" viewBox=\"0 0 {w:.0} {h:.0}\" \
             font-family=\"DejaVu Sans, Helvetica, Arial, sans-serif\" font-size=\"12\" role=\"img\">\n\
             <title>{title}</title>\n<defs>\n"
        );
        for (name, colour) in [
            ("needs", NEEDS),
            ("keeps", KEEPS),
            ("gives", GIVES),
            ("checks", CHECKS),
            ("time", TIME),
        ] {
            let _ = writeln!(
                self.out,
                "<marker id=\"{name}\" viewBox=\"0 0 8 8\" refX=\"7\" refY=\"4\" markerWidth=\"7\" \
                 markerHeight=\"7\" orient=\"auto\"><path d=\"M0 0.8 L7.5 4 L0 7.2 z\" fill=\"{colour}\"/></marker>"
            );
        }
        let _ = writeln!(
            self.out,
            "</defs>\n<rect width=\"100%\" height=\"100%\" fill=\"#fdfdfb\"/>\n\
             <text x=\"24\" y=\"34\" font-size=\"17\" font-weight=\"bold\" fill=\"#222\">{title}</text>"
        );
    }

    /// The edges of the tree, with priors and counts on those of an Or.
    fn tree(&mut self) {
        for node in self.graph.nodes() {
            let Some(from) = self.layout.of_node(node.id) else { continue };
            let bend = from.right() + 14.0;
            // One path for what fades and one for what does not: overlaid strokes would look fuller.
            let trunk = format!("M{:.1} {:.1} H{bend:.1}", from.right(), from.y);
            let mut paths = [(String::new(), false), (String::new(), true)];
            for (i, below) in self.graph.below(node).into_iter().enumerate() {
                let Some(to) = self.layout.of_node(below) else { continue };
                let is_faded = self.is_faded(below);
                let path = &mut paths[usize::from(is_faded)].0;
                if path.is_empty() {
                    path.push_str(&trunk);
                }
                let _ = write!(path, " M{bend:.1} {:.1} V{:.1} H{:.1}", from.y, to.y, to.left());
                if let NodeKind::Or(or) = &node.kind
                    && let Some(said) = self.on_edge(or, i)
                {
                    let _ = writeln!(
                        self.out,
                        "<text x=\"{:.1}\" y=\"{:.1}\" font-size=\"{SMALL}\" fill=\"#7a5b00\"{}>{}</text>",
                        bend + 5.0,
                        to.y - 4.0,
                        self.fade(below),
                        escaped(&said)
                    );
                }
            }
            for (path, is_faded) in paths.iter().filter(|(path, _)| !path.is_empty()) {
                let fade = if *is_faded { FADED } else { "" };
                let _ = writeln!(
                    self.out,
                    "<path d=\"{path}\" fill=\"none\" stroke=\"#777\" stroke-width=\"1.2\"{fade}/>"
                );
            }
        }
    }

    fn on_edge(&self, or: &super::Or, i: usize) -> Option<String> {
        if !or.decides.is_free() {
            return None;
        }
        let branch = &or.branches[i];
        let prior = self.drawing.priors.map_or(branch.prior, |priors| priors.of(or)[i]);
        let mut said = format!("{prior:.2}");
        if let Some((outcomes, domain)) = self.drawing.outcomes {
            let counts = outcomes.of(branch, domain);
            if counts.tries() > 0 {
                let _ = write!(said, " · {} of {}", counts.worked, counts.tries());
            }
        }
        Some(said)
    }

    /// Arrows in time: straight down between steps that meet, bowed and named for the other relations.
    fn temporal(&mut self) {
        for relation in &self.graph.relations {
            let Relation::Temporal { a, allen, b, by } = relation else { continue };
            let (Some(from), Some(to)) = (self.layout.of_node(*a), self.layout.of_node(*b)) else {
                continue;
            };
            let fade = if self.is_faded(*a) { self.fade(*a) } else { self.fade(*b) };
            let (x0, y0) = (from.left() + 12.0, from.bottom());
            let (x1, y1) = (to.left() + 12.0, to.top());
            if *allen == Allen::Meets {
                let _ = writeln!(
                    self.out,
                    "<path d=\"M{x0:.1} {y0:.1} L{x1:.1} {y1:.1}\" fill=\"none\" stroke=\"{TIME}\" \
                     stroke-width=\"1.1\" marker-end=\"url(#time)\"{fade}/>"
                );
            } else {
                let by = by.map(|s| format!(" by {s} s")).unwrap_or_default();
                let said = format!("{}{by}", text::allen(*allen));
                let x = from.right().max(to.right());
                let (ya, yb) = (from.y, to.y);
                let out = x + 26.0;
                let _ = writeln!(
                    self.out,
                    "<path d=\"M{:.1} {ya:.1} C{out:.1} {ya:.1} {out:.1} {yb:.1} {:.1} {yb:.1}\" fill=\"none\" \
                     stroke=\"#444\" stroke-width=\"1.3\" marker-end=\"url(#time)\"{fade}/>\n\
                     <text x=\"{:.1}\" y=\"{:.1}\" font-size=\"{SMALL}\" fill=\"#444\" paint-order=\"stroke\" \
                     stroke=\"#fdfdfb\" stroke-width=\"3\"{fade}>{}</text>",
                    from.right(),
                    to.right() + 2.0,
                    out - 4.0,
                    f64::midpoint(ya, yb) + 4.0,
                    escaped(&said)
                );
            }
        }
    }

    /// Causal edges between terminals and fluents. Those of tasks would cross the whole tree; they are
    /// written in the task's box and beside the fluent.
    fn causal(&mut self) {
        let mut lanes = 0.0;
        for relation in &self.graph.relations {
            let Relation::Causal { node, role, fluent, negated } = relation else { continue };
            if !matches!(self.graph.node(*node).kind, NodeKind::Terminal(_)) {
                continue;
            }
            let (Some(from), Some(to)) =
                (self.layout.of_node(*node), self.layout.fluents.get(*fluent))
            else {
                continue;
            };
            let (colour, dash, marker) = stroke(*role);
            let fade = self.fade(*node);
            // Each edge leaves the rows at its own place, so that parallel ones can be told apart.
            lanes = (lanes + 7.0) % 49.0;
            let turn = self.layout.tree_right + 8.0 + lanes;
            let shift = match role {
                Role::Needs => -6.0,
                Role::Gives | Role::Checks => 6.0,
                _ => 0.0,
            };
            let (x0, y0, x1, y1) = (from.right(), from.y + shift, to.left(), to.y);
            let mid = f64::midpoint(turn, x1);
            // What is given flows to the fluent; what is needed is read from it.
            let ends = match role {
                Role::Gives => format!("marker-end=\"url(#{marker})\""),
                _ => String::new(),
            };
            let _ = write!(
                self.out,
                "<path d=\"M{x0:.1} {y0:.1} H{turn:.1} C{mid:.1} {y0:.1} {mid:.1} {y1:.1} {x1:.1} {y1:.1}\" fill=\"none\" \
                 stroke=\"{colour}\" stroke-width=\"1.2\" stroke-opacity=\"0.75\" {dash} {ends}{fade}>"
            );
            let not = if *negated { "not " } else { "" };
            let tip = format!(
                "{} {} {not}{}",
                self.graph.node(*node).label,
                role.word(),
                self.graph.fluents[*fluent].text
            );
            let _ = writeln!(self.out, "<title>{}</title></path>", escaped(&tip));
            if *negated {
                // A small bar across the end, as on a gate that inverts.
                let _ = writeln!(
                    self.out,
                    "<circle cx=\"{:.1}\" cy=\"{y1:.1}\" r=\"3.2\" fill=\"#fdfdfb\" stroke=\"{colour}\"{fade}/>",
                    x1 - 4.0
                );
            }
        }
    }

    fn node(&mut self, node: &Node) {
        let Some(b) = self.layout.of_node(node.id).copied() else { return };
        let fade = self.fade(node.id);
        let _ = writeln!(
            self.out,
            "<g{fade} data-path=\"{}\"><title>{}</title>",
            escaped(&node.path),
            escaped(&tooltip(node))
        );
        let Box { x, y, w, h } = b;
        let (left, top) = (b.left(), b.top());
        match &node.kind {
            NodeKind::And(and) => {
                let is_recovery = matches!(and.form, Form::Recovery { .. });
                let (fill, line) = match and.form {
                    Form::Task(_) => ("#cfe2f3", "#2f5f8f"),
                    Form::Recovery { .. } => ("#f7dcdc", "#a04040"),
                    _ => ("#e7eff7", "#6f8fae"),
                };
                let dash = if is_recovery { " stroke-dasharray=\"5 3\"" } else { "" };
                let _ = writeln!(
                    self.out,
                    "<rect x=\"{left:.1}\" y=\"{top:.1}\" width=\"{w:.1}\" height=\"{h:.1}\" rx=\"9\" fill=\"{fill}\" \
                     stroke=\"{line}\" stroke-width=\"1.3\"{dash}/>"
                );
            }
            NodeKind::Or(or) => {
                let (tip, bottom, right) = (12.0, b.bottom(), b.right());
                let (fill, line) = match or.decides {
                    Decides::Recovery => ("#fbeeee", "#a04040"),
                    _ => ("#fff3cf", "#a67c00"),
                };
                let (l, r) = (left + tip, right - tip);
                let _ = writeln!(
                    self.out,
                    "<path d=\"M{left:.1} {y:.1} L{l:.1} {top:.1} H{r:.1} L{right:.1} {y:.1} L{r:.1} {bottom:.1} \
                     H{l:.1} z\" fill=\"{fill}\" stroke=\"{line}\" stroke-width=\"1.4\" stroke-dasharray=\"5 3\"/>"
                );
            }
            NodeKind::Terminal(terminal) => {
                let (fill, line) = match terminal.does {
                    Does::Check(_) => ("#eaf4fb", CHECKS),
                    _ => ("#ffffff", "#333333"),
                };
                let _ = writeln!(
                    self.out,
                    "<rect x=\"{left:.1}\" y=\"{top:.1}\" width=\"{w:.1}\" height=\"{h:.1}\" fill=\"{fill}\" stroke=\"{line}\" \
                     stroke-width=\"1.2\"/>"
                );
            }
        }
        let lines = layout::lines(node);
        let first = y - (lines.len() as f64 - 1.0) * 7.0 + 4.0;
        for (i, line) in lines.iter().enumerate() {
            let (size, weight) = if i == 0 { ("12", weight(node)) } else { (SMALL, "normal") };
            let _ = writeln!(
                self.out,
                "<text x=\"{x:.1}\" y=\"{:.1}\" font-size=\"{size}\" font-weight=\"{weight}\" text-anchor=\"middle\" \
                 fill=\"#1c1c1c\">{}</text>",
                first + 14.0 * i as f64,
                escaped(line)
            );
        }
        self.out.push_str("</g>\n");
    }

    fn fluents(&mut self) {
        let spatial: Vec<usize> = self
            .graph
            .relations
            .iter()
            .filter_map(|r| match r {
                Relation::Spatial { fluent, .. } => Some(*fluent),
                _ => None,
            })
            .collect();
        for (i, fluent) in self.graph.fluents.iter().enumerate() {
            let Some(b) = self.layout.fluents.get(i) else { continue };
            let Box { x, y, w, h } = *b;
            let tip = match (&fluent.body, &fluent.ask) {
                (Some(body), Some(ask)) => format!("{} = {body}\n{ask}", fluent.text),
                (Some(body), None) => format!("{} = {body}", fluent.text),
                _ => fluent.text.clone(),
            };
            let inner = if spatial.contains(&i) {
                format!(
                    "<ellipse cx=\"{x:.1}\" cy=\"{y:.1}\" rx=\"{:.1}\" ry=\"{:.1}\" fill=\"none\" stroke=\"#5c8a5c\"/>",
                    w / 2.0 - 3.0,
                    h / 2.0 - 3.0
                )
            } else {
                String::new()
            };
            let _ = writeln!(
                self.out,
                "<g><title>{}</title><ellipse cx=\"{x:.1}\" cy=\"{y:.1}\" rx=\"{:.1}\" ry=\"{:.1}\" fill=\"#e9f5e4\" \
                 stroke=\"#5c8a5c\" stroke-width=\"1.2\"/>{inner}<text x=\"{x:.1}\" y=\"{:.1}\" font-size=\"11\" \
                 text-anchor=\"middle\" fill=\"#1c1c1c\">{}</text></g>",
                escaped(&tip),
                w / 2.0,
                h / 2.0,
                y + 4.0,
                escaped(&shorten(&fluent.text, layout::LONGEST_FLUENT))
            );
            if let Some(said) = self.layout.tags.get(i).filter(|said| !said.is_empty()) {
                let _ = writeln!(
                    self.out,
                    "<text x=\"{:.1}\" y=\"{:.1}\" font-size=\"{SMALL}\" fill=\"#555\">{}</text>",
                    b.right() + 8.0,
                    y + 4.0,
                    escaped(said)
                );
            }
        }
    }

    fn is_faded(&self, id: NodeId) -> bool {
        let Some(parse) = self.drawing.parse else { return false };
        !is_taken(self.graph, parse, id)
    }

    fn fade(&self, id: NodeId) -> &'static str {
        if self.is_faded(id) { FADED } else { "" }
    }
}

/// Whether a parse graph reaches a node: every Or above it was decided its way.
fn is_taken(graph: &Graph, parse: &ParseGraph, id: NodeId) -> bool {
    let mut node = graph.node(id);
    while let Some(above) = node.parent {
        let parent = graph.node(above);
        if let NodeKind::Or(or) = &parent.kind {
            let branch = or.branches.iter().find(|branch| branch.node == node.id);
            let is_its = branch.is_some_and(|b| parse.branch(&parent.path) == Some(&b.name));
            if !is_its {
                return false;
            }
        }
        node = parent;
    }
    true
}

fn stroke(role: Role) -> (&'static str, &'static str, &'static str) {
    match role {
        Role::Needs | Role::Guard => (NEEDS, "stroke-dasharray=\"6 3\"", "needs"),
        Role::Keeps => (KEEPS, "stroke-dasharray=\"2 3\"", "keeps"),
        Role::Gives => (GIVES, "", "gives"),
        Role::Checks => (CHECKS, "", "checks"),
        Role::Until => (TIME, "stroke-dasharray=\"8 3 2 3\"", "time"),
    }
}

fn weight(node: &Node) -> &'static str {
    match &node.kind {
        NodeKind::And(and) if matches!(and.form, Form::Task(_)) => "bold",
        _ => "normal",
    }
}

fn tooltip(node: &Node) -> String {
    let mut said = format!("{}\n{}", node.path, node.label);
    let causes = match &node.kind {
        NodeKind::And(and) => &and.causes,
        NodeKind::Terminal(terminal) => &terminal.causes,
        NodeKind::Or(_) => return said,
    };
    for (word, all) in
        [("needs", &causes.needs), ("keeps", &causes.keeps), ("gives", &causes.gives)]
    {
        for e in all {
            let _ = write!(said, "\n{word} {}", text::expr(e));
        }
    }
    said
}

/// Writes text so that XML reads it as text.
fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            // Other control characters are not allowed in XML at all.
            c if c.is_control() && c != '\n' => out.push(' '),
            c => out.push(c),
        }
    }
    out
}
