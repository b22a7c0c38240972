//! Programs of several files under one roof: the standard library first, a user's files over it.
//!
//! A later definition replaces an earlier one of the same name from another file; twice in one file is
//! a mistake. Every definition knows the [`Source`] it came from. Reading files is the caller's work:
//! texts come in, the standard library is embedded.

mod checking;
mod imports;

use std::collections::BTreeMap;
use std::sync::Arc;

use super::ast::{
    Act, ActionItem, Call, Conditions, FluentItem, Item, ModelItem, Name, Program, SceneItem, Span,
    Step, TaskItem, TwinItem, TypeItem,
};
use super::builtins;
use super::diagnostic::{Diagnostic, Source};
use super::parse;

/// The texts of the standard library: name, text.
const STANDARD: &[(&str, &str)] = &[
    ("stdlib/fluents/std.task", include_str!("../../../stdlib/fluents/std.task")),
    ("stdlib/tasks/std.task", include_str!("../../../stdlib/tasks/std.task")),
    ("stdlib/scenes/kitchen.task", include_str!("../../../stdlib/scenes/kitchen.task")),
];

/// The name of the task that steps outside of any become.
pub const STEPS: &str = "steps";

/// The scene that is meant when nobody names one.
pub const DEFAULT_SCENE: &str = "kitchen";

/// What a definition is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Kind {
    Type,
    Fluent,
    /// Tasks and actions are called alike, so they share their names.
    Callable,
    Scene,
    Twin,
    Model,
}

/// One text that was read.
#[derive(Debug, Clone)]
struct File {
    source: Source,
    program: Program,
    /// What parsing and merging found.
    diagnostics: Vec<Diagnostic>,
}

/// All definitions by name.
#[derive(Debug, Clone, Default)]
pub struct Library {
    files: Vec<Arc<File>>,
    /// Kind and name → file and item.
    index: BTreeMap<(Kind, String), (usize, usize)>,
    /// Imported scripts: file name → text.
    scripts: BTreeMap<String, String>,
    /// The file of [`Self::define`].
    typed: Option<usize>,
}

/// A task or an action, which are called alike.
#[derive(Debug, Clone, Copy)]
pub enum Callable<'a> {
    /// A task: made of steps.
    Task(&'a TaskItem),
    /// An action: runs a script.
    Action(&'a ActionItem),
}

/// What names may stand for beside parameters: the objects of a scene, by name and type.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Scope {
    /// Object name → type name.
    pub objects: BTreeMap<String, String>,
}

impl Library {
    /// A library with nothing in it.
    pub fn new() -> Self {
        Self::default()
    }

    /// The embedded standard library: fluents, tasks, and the kitchen scene.
    pub fn standard() -> Self {
        let mut library = Self::new();
        for (name, text) in STANDARD {
            library.add(Source::new(*name, *text));
        }
        library
    }

    /// Reads a text into the library and returns its number. A text of a name that is already there
    /// is read in its place; other definitions of the same names are replaced. What is wrong with it
    /// is told by [`Self::check`].
    pub fn add(&mut self, source: Source) -> usize {
        let (program, mut diagnostics) = parse(&source.text);
        Self::find_doubles(&program, &mut diagnostics);
        for diagnostic in &mut diagnostics {
            diagnostic.file.clone_from(&source.name);
        }
        let file = Arc::new(File { source, program, diagnostics });
        let same = |(at, f): (usize, &Arc<File>)| {
            (f.source.name == file.source.name && self.typed != Some(at)).then_some(at)
        };
        let known = self.files.iter().enumerate().find_map(same);
        let at = known.unwrap_or(self.files.len());
        if known.is_some() {
            self.files[at] = file;
        } else {
            self.files.push(file);
        }
        self.reindex();
        at
    }

    /// Returns the call that carries out steps typed at the prompt or written at the end of a script: the
    /// one call itself, or that of a task [`STEPS`] made of them, which replaces an earlier one.
    pub fn define(&mut self, source: &Source, steps: &[Step]) -> Call {
        if let [Step::Act(Act { call, via, holds, .. })] = steps
            && via.is_empty()
            && holds.is_empty()
        {
            return call.clone();
        }
        let span = Span { from: 0, to: source.text.len() };
        let name = Name { text: STEPS.into(), span };
        let task = TaskItem {
            doc: Vec::new(),
            was: Vec::new(),
            name: name.clone(),
            params: Vec::new(),
            say: Vec::new(),
            conditions: Conditions::default(),
            limit: None,
            steps: steps.to_vec(),
            recoveries: Vec::new(),
            span,
        };
        let file = Arc::new(File {
            source: source.clone(),
            program: Program { items: vec![Item::Task(task)] },
            diagnostics: Vec::new(),
        });
        if let Some(at) = self.typed {
            self.files[at] = file;
        } else {
            self.typed = Some(self.files.len());
            self.files.push(file);
        }
        self.reindex();
        Call { name, args: Vec::new(), span }
    }

    /// Returns how many files there are; they are numbered from 0.
    pub fn len(&self) -> usize {
        self.files.len()
    }

    /// Returns whether there is no file.
    pub fn is_empty(&self) -> bool {
        self.files.is_empty()
    }

    /// Returns the scripts that were imported: file name → text.
    pub fn scripts(&self) -> &BTreeMap<String, String> {
        &self.scripts
    }

    fn reindex(&mut self) {
        self.index.clear();
        for (f, file) in self.files.iter().enumerate() {
            for (i, item) in file.program.items.iter().enumerate() {
                if let Some((kind, name)) = key(item) {
                    self.index.insert((kind, name.text.clone()), (f, i));
                }
            }
        }
    }

    fn get(&self, kind: Kind, name: &str) -> Option<(&Item, &Source)> {
        let (f, i) = self.index.get(&(kind, name.to_string()))?;
        let file = &self.files[*f];
        Some((&file.program.items[*i], &file.source))
    }

    fn all(&self, kind: Kind) -> impl Iterator<Item = (&Item, &Source)> {
        self.index.iter().filter(move |((k, _), _)| *k == kind).map(|(_, (f, i))| {
            let file = &self.files[*f];
            (&file.program.items[*i], &file.source)
        })
    }

    /// Returns a task with the source it came from.
    pub fn task(&self, name: &str) -> Option<(&TaskItem, &Source)> {
        match self.get(Kind::Callable, name)? {
            (Item::Task(task), source) => Some((task, source)),
            _ => None,
        }
    }

    /// Returns an action with the source it came from.
    pub fn action(&self, name: &str) -> Option<(&ActionItem, &Source)> {
        match self.get(Kind::Callable, name)? {
            (Item::Action(action), source) => Some((action, source)),
            _ => None,
        }
    }

    /// Returns the task or the action of that name.
    pub fn callable(&self, name: &str) -> Option<(Callable<'_>, &Source)> {
        match self.get(Kind::Callable, name)? {
            (Item::Action(action), source) => Some((Callable::Action(action), source)),
            (Item::Task(task), source) => Some((Callable::Task(task), source)),
            _ => None,
        }
    }

    /// Returns a fluent with the source it came from.
    pub fn fluent(&self, name: &str) -> Option<(&FluentItem, &Source)> {
        match self.get(Kind::Fluent, name)? {
            (Item::Fluent(fluent), source) => Some((fluent, source)),
            _ => None,
        }
    }

    /// Returns a type with the source it came from.
    pub fn object_type(&self, name: &str) -> Option<(&TypeItem, &Source)> {
        match self.get(Kind::Type, name)? {
            (Item::Type(ty), source) => Some((ty, source)),
            _ => None,
        }
    }

    /// Returns a scene with the source it came from.
    pub fn scene(&self, name: &str) -> Option<(&SceneItem, &Source)> {
        match self.get(Kind::Scene, name)? {
            (Item::Scene(scene), source) => Some((scene, source)),
            _ => None,
        }
    }

    /// Returns a twin with the source it came from.
    pub fn twin(&self, name: &str) -> Option<(&TwinItem, &Source)> {
        match self.get(Kind::Twin, name)? {
            (Item::Twin(twin), source) => Some((twin, source)),
            _ => None,
        }
    }

    /// Returns a model with the source it came from.
    pub fn model(&self, name: &str) -> Option<(&ModelItem, &Source)> {
        match self.get(Kind::Model, name)? {
            (Item::Model(model), source) => Some((model, source)),
            _ => None,
        }
    }

    /// Returns all tasks, by name.
    pub fn tasks(&self) -> impl Iterator<Item = (&TaskItem, &Source)> {
        self.all(Kind::Callable).filter_map(|(item, source)| match item {
            Item::Task(task) => Some((task, source)),
            _ => None,
        })
    }

    /// Returns all tasks and actions, by name.
    pub fn callables(&self) -> impl Iterator<Item = Callable<'_>> {
        self.all(Kind::Callable).filter_map(|(item, _)| match item {
            Item::Task(task) => Some(Callable::Task(task)),
            Item::Action(action) => Some(Callable::Action(action)),
            _ => None,
        })
    }

    /// Returns all actions, by name.
    pub fn actions(&self) -> impl Iterator<Item = (&ActionItem, &Source)> {
        self.all(Kind::Callable).filter_map(|(item, source)| match item {
            Item::Action(action) => Some((action, source)),
            _ => None,
        })
    }

    /// Returns all fluents, by name.
    pub fn fluents(&self) -> impl Iterator<Item = (&FluentItem, &Source)> {
        self.all(Kind::Fluent).filter_map(|(item, source)| match item {
            Item::Fluent(fluent) => Some((fluent, source)),
            _ => None,
        })
    }

    /// Returns all scenes, by name.
    pub fn scenes(&self) -> impl Iterator<Item = (&SceneItem, &Source)> {
        self.all(Kind::Scene).filter_map(|(item, source)| match item {
            Item::Scene(scene) => Some((scene, source)),
            _ => None,
        })
    }

    /// Returns every twin with its source.
    pub fn twins(&self) -> impl Iterator<Item = (&TwinItem, &Source)> {
        self.all(Kind::Twin).filter_map(|(item, source)| match item {
            Item::Twin(twin) => Some((twin, source)),
            _ => None,
        })
    }

    /// Returns the names of all object types, the built-in root among them.
    pub fn type_names(&self) -> impl Iterator<Item = &str> {
        let types = self.index.keys().filter(|(kind, _)| *kind == Kind::Type);
        types.map(|(_, name)| name.as_str()).chain([builtins::OBJECT])
    }

    /// Returns the top-level steps of a file, in order: what running it does.
    pub fn runs(&self, file: usize) -> impl Iterator<Item = &Step> {
        let items = self.files.get(file).map(|f| f.program.items.as_slice()).unwrap_or_default();
        items.iter().filter_map(|item| match item {
            Item::Run(step) => Some(step),
            _ => None,
        })
    }

    /// Returns a file's text.
    pub fn source(&self, file: usize) -> Option<&Source> {
        self.files.get(file).map(|f| &f.source)
    }

    /// Returns the text of that name.
    pub fn source_named(&self, name: &str) -> Option<&Source> {
        self.files.iter().map(|f| &f.source).find(|s| s.name == name)
    }

    /// Returns a file's tree.
    pub fn program(&self, file: usize) -> Option<&Program> {
        self.files.get(file).map(|f| &f.program)
    }

    /// Returns whether a type is another or descends from it. Every type is an `Object`.
    pub fn is_a(&self, ty: &str, ancestor: &str) -> bool {
        let mut open = vec![ty];
        let mut seen = Vec::new();
        while let Some(ty) = open.pop() {
            if ty == ancestor {
                return true;
            }
            // Types that descend from each other are a mistake, but not one to hang on.
            if seen.contains(&ty) {
                continue;
            }
            seen.push(ty);
            if let Some((item, _)) = self.object_type(ty) {
                open.extend(item.parents.iter().map(|parent| parent.text.as_str()));
            }
        }
        ancestor == builtins::OBJECT
    }

    /// Returns the scene that is meant when nobody names one: the last one a user's file defines, else
    /// [`DEFAULT_SCENE`].
    pub fn default_scene(&self) -> &str {
        let own =
            self.files.iter().filter(|f| !STANDARD.iter().any(|(name, _)| *name == f.source.name));
        own.flat_map(|file| &file.program.items)
            .filter_map(|item| match item {
                Item::Scene(scene) => Some(scene.name.text.as_str()),
                _ => None,
            })
            .next_back()
            .unwrap_or(DEFAULT_SCENE)
    }

    /// Returns the objects of a scene: what names mean while that scene is on the table.
    pub fn scope(&self, scene: &str) -> Scope {
        let objects = self.scene(scene).map_or_else(BTreeMap::new, |(scene, _)| {
            scene.things.iter().map(|t| (t.name.text.clone(), t.ty.text.clone())).collect()
        });
        Scope { objects }
    }
}

/// Returns under what name an item is found.
fn key(item: &Item) -> Option<(Kind, &Name)> {
    let (kind, name) = match item {
        Item::Type(item) => (Kind::Type, &item.name),
        Item::Fluent(item) => (Kind::Fluent, &item.name),
        Item::Action(item) => (Kind::Callable, &item.name),
        Item::Task(item) => (Kind::Callable, &item.name),
        Item::Scene(item) => (Kind::Scene, &item.name),
        Item::Twin(item) => (Kind::Twin, &item.name),
        Item::Model(item) => (Kind::Model, &item.name),
        Item::Import(_) | Item::Run(_) | Item::Bad(_) => return None,
    };
    (!name.text.is_empty()).then_some((kind, name))
}

impl<'a> Callable<'a> {
    /// Returns its name.
    pub fn name(self) -> &'a str {
        match self {
            Self::Task(task) => &task.name.text,
            Self::Action(action) => &action.name.text,
        }
    }

    /// Returns where its name stands.
    pub fn span(self) -> Span {
        match self {
            Self::Task(task) => task.name.span,
            Self::Action(action) => action.name.span,
        }
    }

    /// Returns its parameters.
    pub fn params(self) -> &'a [super::ast::Param] {
        match self {
            Self::Task(task) => &task.params,
            Self::Action(action) => &action.params,
        }
    }

    /// Returns what it needs, keeps and gives.
    pub fn conditions(self) -> &'a Conditions {
        match self {
            Self::Task(task) => &task.conditions,
            Self::Action(action) => &action.conditions,
        }
    }

    /// Returns the sentences that mean it.
    pub fn say(self) -> &'a [super::ast::Text] {
        match self {
            Self::Task(task) => &task.say,
            Self::Action(action) => &action.say,
        }
    }

    /// Returns its documentation lines.
    pub fn doc(self) -> &'a [String] {
        match self {
            Self::Task(task) => &task.doc,
            Self::Action(action) => &action.doc,
        }
    }
}
