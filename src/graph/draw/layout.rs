//! Where everything stands: the tree in columns by depth and rows by order, fluents in a last column.

use crate::graph::{And, Decides, Form, Graph, Node, NodeId, NodeKind, Relation, Role};
use crate::language::text;

/// Font size of second lines and of the legend, px.
pub(super) const SMALL: &str = "10.5";
/// Fluents are cut to this many characters; the whole text is their tool tip.
pub(super) const LONGEST_FLUENT: usize = 38;
/// Lines in boxes are cut to this many characters.
const LONGEST_LINE: usize = 52;
/// What stands beside a fluent is cut to this many characters.
const LONGEST_TAG: usize = 80;
/// What a fluent in a guard does.
const DECIDES: &str = "decides ";
/// Between columns, px: room for a prior and its counts.
const GAP: f64 = 62.0;
/// Between rows, px.
const ROW_GAP: f64 = 14.0;
/// Above the tree, for the title, px.
const TOP: f64 = 56.0;
/// Below it, for the legend, px.
const BOTTOM: f64 = 62.0;
/// Between the tree and the fluents, px: room for the edges.
const CAUSAL: f64 = 200.0;
/// The legend needs this much, px.
const LEAST_WIDTH: f64 = 1500.0;

/// A box by its middle, px.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Box {
    pub(super) x: f64,
    pub(super) y: f64,
    pub(super) w: f64,
    pub(super) h: f64,
}

impl Box {
    pub(super) fn left(&self) -> f64 {
        self.x - self.w / 2.0
    }
    pub(super) fn right(&self) -> f64 {
        self.x + self.w / 2.0
    }
    pub(super) fn top(&self) -> f64 {
        self.y - self.h / 2.0
    }
    pub(super) fn bottom(&self) -> f64 {
        self.y + self.h / 2.0
    }
}

/// Where everything stands.
pub(super) struct Layout {
    nodes: Vec<Option<Box>>,
    pub(super) fluents: Vec<Box>,
    /// What tasks and branches want of each fluent, in words: `pick gives, place needs`.
    pub(super) tags: Vec<String>,
    /// Right edge of the tree, px.
    pub(super) tree_right: f64,
    pub(super) width: f64,
    pub(super) height: f64,
}

impl Layout {
    /// Lays a graph out.
    pub(super) fn of(graph: &Graph) -> Self {
        let n = graph.nodes().len();
        let mut depth = vec![0_usize; n];
        let mut columns: Vec<f64> = Vec::new();
        for node in graph.nodes() {
            if is_hidden(graph, node) {
                continue;
            }
            let d = node.parent.map_or(0, |p| depth[p.idx()] + 1);
            depth[node.id.idx()] = d;
            columns.resize(columns.len().max(d + 1), 0.0);
            columns[d] = columns[d].max(size(node).0);
        }
        let mut lefts = vec![24.0];
        for width in &columns {
            lefts.push(lefts[lefts.len() - 1] + width + GAP);
        }
        let mut layout = Self {
            nodes: vec![None; n],
            fluents: Vec::new(),
            tags: tags(graph),
            tree_right: lefts[columns.len()] - GAP,
            width: 0.0,
            height: 0.0,
        };
        let bottom = layout.place(graph, graph.root().id, TOP, &depth, &lefts);
        layout.place_fluents(graph);
        let tagged = layout.fluents.iter().zip(&layout.tags);
        let right = tagged
            .map(|(b, tag)| b.right() + 8.0 + width_of(tag, 11.0))
            .fold(layout.tree_right, f64::max);
        let low = layout.fluents.iter().map(Box::bottom).fold(bottom, f64::max);
        layout.width = (right + 24.0).max(LEAST_WIDTH);
        layout.height = low + BOTTOM;
        layout
    }

    pub(super) fn of_node(&self, id: NodeId) -> Option<&Box> {
        self.nodes[id.idx()].as_ref()
    }

    /// Places what lies below `id` from `top` down, then the node beside its middle; returns the bottom.
    fn place(
        &mut self,
        graph: &Graph,
        id: NodeId,
        top: f64,
        depth: &[usize],
        lefts: &[f64],
    ) -> f64 {
        let node = graph.node(id);
        let (w, h) = size(node);
        let mut low = top;
        let (mut first, mut last) = (None, top);
        for below in graph.below(node) {
            if is_hidden(graph, graph.node(below)) {
                continue;
            }
            low = self.place(graph, below, low, depth, lefts);
            let y = self.nodes[below.idx()].map_or(top, |b| b.y);
            first.get_or_insert(y);
            last = y;
        }
        let middle = first.map_or(top + h / 2.0, |first| f64::midpoint(first, last));
        // A box taller than what lies below it pushes down what follows.
        let y = middle.max(top + h / 2.0);
        let x = lefts[depth[id.idx()]] + w / 2.0;
        self.nodes[id.idx()] = Some(Box { x, y, w, h });
        low.max(y + h / 2.0 + ROW_GAP)
    }

    /// Puts each fluent at the mean height of the steps that speak of it, and then pushes them apart.
    fn place_fluents(&mut self, graph: &Graph) {
        let h = 26.0;
        let mut wanted: Vec<(usize, f64)> = Vec::new();
        for i in 0..graph.fluents.len() {
            let ys: Vec<f64> = graph
                .relations
                .iter()
                .filter_map(|relation| match relation {
                    Relation::Causal { node, fluent, .. } if *fluent == i => {
                        Some(self.of_node(*node)?.y)
                    }
                    _ => None,
                })
                .collect();
            let mean = if ys.is_empty() { TOP } else { ys.iter().sum::<f64>() / ys.len() as f64 };
            wanted.push((i, mean));
        }
        wanted.sort_by(|a, b| a.1.total_cmp(&b.1));
        let widest = graph
            .fluents
            .iter()
            .map(|f| width_of(&shorten(&f.text, LONGEST_FLUENT), 11.0) + 34.0)
            .fold(60.0, f64::max);
        let x = self.tree_right + CAUSAL + widest / 2.0;
        self.fluents = vec![Box { x, y: 0.0, w: widest, h }; graph.fluents.len()];
        // Down once so that none overlap, then up so that the column stays centred on its wishes.
        let step = h + 12.0;
        let mut ys: Vec<f64> = Vec::new();
        for (_, y) in &wanted {
            let least = ys.last().map_or(TOP + h / 2.0, |last| last + step);
            ys.push(y.max(least));
        }
        let mut most = f64::INFINITY;
        for (k, (_, y)) in wanted.iter().enumerate().rev() {
            let room = TOP + h / 2.0 + step * k as f64;
            if ys[k] > most || (ys[k] > *y && most.is_finite()) {
                ys[k] = y.min(most).max(room);
            }
            most = ys[k] - step;
        }
        for k in 1..ys.len() {
            ys[k] = ys[k].max(ys[k - 1] + step);
        }
        for ((i, _), y) in wanted.iter().zip(ys) {
            self.fluents[*i].y = y;
        }
    }
}

/// Says beside each fluent which tasks and branches need, keep or give it.
fn tags(graph: &Graph) -> Vec<String> {
    let mut tags: Vec<Vec<String>> = vec![Vec::new(); graph.fluents.len()];
    for relation in &graph.relations {
        let Relation::Causal { node, role, fluent, negated } = relation else { continue };
        let node = graph.node(*node);
        let who = match &node.kind {
            NodeKind::Terminal(_) => continue,
            NodeKind::And(And { form: Form::Task(call), .. }) => call.name.text.clone(),
            _ => node.label.clone(),
        };
        let not = if *negated { " not" } else { "" };
        if *role == Role::Guard {
            // One word for all the branches it decides.
            match tags[*fluent].iter_mut().find(|tag| tag.starts_with(DECIDES)) {
                Some(tag) if !tag[DECIDES.len()..].split(", ").any(|known| known == who) => {
                    tag.push_str(", ");
                    tag.push_str(&who);
                }
                Some(_) => {}
                None => tags[*fluent].push(format!("{DECIDES}{who}")),
            }
            continue;
        }
        let tag = format!("{who} {}{not}", role.word());
        if !tags[*fluent].contains(&tag) {
            tags[*fluent].push(tag);
        }
    }
    tags.into_iter().map(|all| shorten(&all.join(", "), LONGEST_TAG)).collect()
}

/// Branches that do nothing are not drawn: `nominal` of a recovery, `done` of a loop, a missing `else`.
fn is_hidden(graph: &Graph, node: &Node) -> bool {
    let is_skip = matches!(&node.kind, NodeKind::And(And { form: Form::Skip, .. }));
    is_skip
        && node.parent.is_some_and(
            |above| !matches!(&graph.node(above).kind, NodeKind::Or(or) if or.decides.is_free()),
        )
}

fn size(node: &Node) -> (f64, f64) {
    let lines = lines(node);
    let width = lines
        .iter()
        .enumerate()
        .map(|(i, line)| width_of(line, if i == 0 { 12.6 } else { 10.5 }))
        .fold(0.0, f64::max);
    let tip = if matches!(node.kind, NodeKind::Or(_)) { 34.0 } else { 20.0 };
    (width + tip, 16.0 + 14.0 * lines.len() as f64)
}

/// What stands in a node: its label, then what a reader wants to know at once.
pub(super) fn lines(node: &Node) -> Vec<String> {
    let mut lines = vec![shorten(&node.label, LONGEST_LINE)];
    match &node.kind {
        NodeKind::And(and) => {
            if let Form::Task(_) = and.form {
                for (word, all) in [
                    ("needs", &and.causes.needs),
                    ("keeps", &and.causes.keeps),
                    ("gives", &and.causes.gives),
                ] {
                    let each = all.iter().map(|e| format!("{word} {}", text::expr(e)));
                    lines.extend(each.map(|line| shorten(&line, LONGEST_LINE)));
                }
            }
            for e in &and.holding.whiles {
                lines.push(shorten(&format!("while {}", text::expr(e)), LONGEST_LINE));
            }
            for e in &and.holding.untils {
                lines.push(shorten(&format!("until {}", text::expr(e)), LONGEST_LINE));
            }
            if let Form::Recovery { remedy: Some(remedy), .. } = &and.form {
                lines.push(shorten(&format!("then {}", text::remedy(remedy)), LONGEST_LINE));
            }
        }
        NodeKind::Or(or) => {
            if let Decides::Choice = or.decides {
                let guards = or.branches.iter().filter_map(|branch| {
                    let guard = branch.guard.as_ref()?;
                    Some(format!("{} when {}", branch.name, text::expr(guard)))
                });
                lines.extend(guards.map(|line| shorten(&line, LONGEST_LINE)));
            }
            if let Some(at) = or.via {
                lines.push(shorten(&format!("via {}", or.branches[at].name), LONGEST_LINE));
            }
        }
        NodeKind::Terminal(terminal) => {
            for e in &terminal.holding.untils {
                lines.push(shorten(&format!("until {}", text::expr(e)), LONGEST_LINE));
            }
        }
    }
    lines
}

/// Returns about how wide a text is in the usual sans-serif, px.
pub(super) fn width_of(text: &str, size: f64) -> f64 {
    let ems: f64 = text
        .chars()
        .map(|c| match c {
            'i' | 'j' | 'l' | '.' | ',' | ':' | '(' | ')' | ' ' | '\'' | '|' => 0.36,
            'm' | 'w' | 'M' | 'W' => 0.95,
            c if c.is_ascii_uppercase() => 0.70,
            _ => 0.61,
        })
        .sum();
    ems * size
}

/// Cuts a text to `most` characters, the last an ellipsis.
pub(super) fn shorten(text: &str, most: usize) -> String {
    if text.chars().count() <= most {
        return text.to_owned();
    }
    let kept: String = text.chars().take(most - 1).collect();
    format!("{}…", kept.trim_end())
}
