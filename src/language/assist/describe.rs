//! What a name means: signature, documentation, what it needs and gives.

use std::fmt::Write as _;

use super::super::ast::{ActionItem, Call, Conditions, Expr, Param};
use super::super::bind;
use super::super::builtins;
use super::super::library::{Callable, Library, Scope};
use super::super::{nearest, script_words, text};

/// What a call needs, keeps and gives, arguments filled in, as text.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Promises {
    /// Must hold before.
    pub needs: Vec<String>,
    /// Must hold throughout.
    pub keeps: Vec<String>,
    /// Holds afterwards.
    pub gives: Vec<String>,
}

/// Returns `pour(source: Container, target: Container, amount: Volume = filled(source))`.
pub fn signature(name: &str, params: &[Param]) -> String {
    let params: Vec<String> = params
        .iter()
        .map(|param| {
            let default = param.default.as_ref().map(|e| format!(" = {}", text::expr(e)));
            format!("{}: {}{}", param.name.text, param.ty.text, default.unwrap_or_default())
        })
        .collect();
    format!("{name}({})", params.join(", "))
}

/// Returns what a call needs, keeps and gives; `None` when it does not fit what it calls.
pub fn promises(library: &Library, call: &Call) -> Option<Promises> {
    let (callable, _) = library.callable(&call.name.text)?;
    let (params, conditions) = match callable {
        Callable::Task(task) => (&task.params, &task.conditions),
        Callable::Action(action) => (&action.params, &action.conditions),
    };
    let mut scope = bind::Scope::new();
    for bound in bind::arguments("", params, call).ok()? {
        let value = bound.values.into_iter().next()?;
        let value = if bound.default { bind::fill(&value, &scope) } else { value };
        scope.insert(bound.name, value);
    }
    let fill = |all: &[Expr]| all.iter().map(|e| text::expr(&bind::fill(e, &scope))).collect();
    let Conditions { needs, keeps, gives } = conditions;
    Some(Promises { needs: fill(needs), keeps: fill(keeps), gives: fill(gives) })
}

/// Returns what a name means, as lines of text: its signature or type, its documentation, what it needs and
/// gives, and where it is defined. What nothing else is called may be a word of action scripts, such as `arm.close`.
pub fn describe(library: &Library, scope: &Scope, name: &str) -> Option<String> {
    if let Some((callable, source)) = library.callable(name) {
        let mut said = signature(name, callable.params());
        documentation(callable.doc(), &mut said);
        let conditions = match callable {
            Callable::Task(task) => &task.conditions,
            Callable::Action(action) => &action.conditions,
        };
        for (word, all) in [
            ("needs", &conditions.needs),
            ("keeps", &conditions.keeps),
            ("gives", &conditions.gives),
        ] {
            for condition in all {
                let _ = write!(said, "\n  {word}  {}", text::expr(condition));
            }
        }
        for say in callable.say() {
            let _ = write!(said, "\n  say    \"{}\"", say.text);
        }
        if let Callable::Action(ActionItem { script: Some((script, _)), .. }) = callable {
            let _ = write!(said, "\n  run    {script}");
        }
        let _ = write!(said, "\n  {}", source.place(callable.span()));
        return Some(said);
    }
    if let Some(said) = asked(library, name) {
        return Some(said);
    }
    if let Some(ty) = scope.objects.get(name) {
        let looks = library.scenes().find_map(|(scene, source)| {
            let thing = scene.things.iter().find(|thing| thing.name.text == name)?;
            let thing_said = super::super::sentence::Thing::of(thing);
            Some((thing_said.looks, source.place(thing.name.span)))
        });
        let mut said = format!("{name}: {ty}");
        if let Some((looks, place)) = looks {
            if !looks.is_empty() {
                let _ = write!(said, "\n  {looks}");
            }
            let _ = write!(said, "\n  {place}");
        }
        return Some(said);
    }
    if let Some((ty, source)) = library.object_type(name) {
        let parents: Vec<&str> = ty.parents.iter().map(|parent| parent.text.as_str()).collect();
        let mut said = match parents.as_slice() {
            [] => format!("type {name}"),
            parents => format!("type {name}: {}", parents.join(", ")),
        };
        documentation(&ty.doc, &mut said);
        let _ = write!(said, "\n  {}", source.place(ty.name.span));
        return Some(said);
    }
    let constant = builtins::CONSTANTS.iter().find(|(constant, ..)| *constant == name);
    if let Some((_, ty, doc)) = constant {
        return Some(format!("{name}: {ty}\n  {doc}"));
    }
    let built_in = builtins::TYPES.iter().find(|(ty, _)| *ty == name);
    let built_in = built_in.map(|(ty, doc)| format!("type {ty}\n  {doc}"));
    built_in.or_else(|| script_words::describe(name))
}

/// Returns what can be asked under a name: a fluent, or something that is measured.
pub(super) fn asked(library: &Library, name: &str) -> Option<String> {
    if let Some((fluent, source)) = library.fluent(name) {
        let mut said = signature(name, &fluent.params);
        documentation(&fluent.doc, &mut said);
        let _ = write!(said, "\n  is     {}", text::expr(&fluent.body));
        if let Some(ask) = &fluent.ask {
            let _ = write!(said, "\n  ask    \"{}\"", ask.text);
        }
        let _ = write!(said, "\n  {}", source.place(fluent.name.span));
        return Some(said);
    }
    let function = builtins::function(name)?;
    Some(format!("{}\n  {}", function.signature(), function.doc))
}

/// Returns the name that was probably meant, of all that [`describe`] tells about.
pub fn nearest_name<'a>(library: &'a Library, scope: &'a Scope, name: &str) -> Option<&'a str> {
    let tasks = library.tasks().map(|(task, _)| task.name.text.as_str());
    let actions = library.actions().map(|(action, _)| action.name.text.as_str());
    let fluents = library.fluents().map(|(fluent, _)| fluent.name.text.as_str());
    let objects = scope.objects.keys().map(String::as_str);
    let measured = builtins::FUNCTIONS.iter().map(|function| function.name);
    let known = tasks.chain(actions).chain(fluents).chain(objects).chain(library.type_names());
    let of_scripts = script_words::WORDS.iter().map(|word| word.name);
    let name = name.rsplit('.').next().unwrap_or(name);
    nearest(name, known.chain(measured).chain(of_scripts))
}

fn documentation(doc: &[String], said: &mut String) {
    for line in doc {
        let _ = write!(said, "\n  {line}");
    }
}
