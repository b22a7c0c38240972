//! What could stand at a place of a half-typed text, the likeliest first.

use super::super::ast::Program;
use super::super::builtins::{self, Ty};
use super::super::library::Library;
use super::super::parse;
use super::super::parse::lexer::{Kind, Token};
use super::{Place, called, code, describe, locals, words};
use crate::units::Dimension;

/// What kind of thing is offered.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CompletionKind {
    /// A task.
    Task,
    /// An action.
    Action,
    /// A fluent of the program, or something that is measured.
    Fluent,
    /// A thing on the table, or a constant.
    Object,
    /// A parameter or a `let`.
    Local,
    /// A parameter of the call being typed, with its colon.
    Parameter,
    /// A type.
    Type,
    /// A branch that `via` may name.
    Branch,
    /// A unit.
    Unit,
    /// A word of the language.
    Keyword,
}

/// Something that could stand here.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Completion {
    /// What is shown and looked for.
    pub label: String,
    /// What it is.
    pub kind: CompletionKind,
    /// Its signature or type.
    pub detail: String,
    /// What it means.
    pub doc: String,
    /// What is put in place of the word that was begun.
    pub insert: String,
}

/// Where the place lies.
enum Context {
    /// A step may begin here.
    Step,
    /// Nothing has begun: an item or a step.
    Top,
    /// A condition or a value.
    Value,
    /// The argument of a call.
    Argument(Given),
    /// A type.
    Type,
    /// A branch of the call before.
    Branch(String),
    /// Behind a number, that of an argument where it is all there is of one.
    Unit(Option<Given>),
    /// A sentence is under way, which names things.
    Sentence,
    /// A name that the writer makes up, or a text.
    Nothing,
}

/// An argument that is being typed.
struct Given {
    /// What is called.
    call: String,
    /// Which argument, from 0.
    at: usize,
    /// Its name, where that stands before it.
    name: Option<String>,
}

/// Returns what could stand at a place, those that fit its type first.
///
/// A word that has been begun keeps only what begins with it. Nothing is asked of a device.
pub fn complete(place: &Place<'_>) -> Vec<Completion> {
    let before = place.text.get(..place.at).unwrap_or(place.text);
    let mut code = code(before);
    let in_note = super::tokens(before).last().is_some_and(|last| {
        matches!(last.kind, Kind::Note | Kind::Doc | Kind::OpenText)
            && !before[last.to..].contains('\n')
    });
    if in_note {
        return Vec::new();
    }
    let begun = match code.last() {
        Some(last) if last.kind == Kind::Word && last.to == before.len() => {
            let word = last.text(before).to_owned();
            code.pop();
            word
        }
        _ => String::new(),
    };
    let (program, _) = parse(place.text);
    let finder = Finder { place, program: &program, found: Vec::new() };
    let context =
        if says_words(&code, before) { Context::Sentence } else { context(&code, before) };
    let mut found = finder.find(&context);
    let given = given(&code, before);
    found.retain(|offer| {
        let is_given = offer.kind == CompletionKind::Object && given.contains(&&*offer.label);
        offer.label.starts_with(&begun) && offer.label != begun && !is_given
    });
    found
}

/// Whether nothing but words stands on the line, outside of all brackets, and none that begins a step or an item: what the
/// language has no form for.
fn says_words(code: &[Token], text: &str) -> bool {
    if called::open_bracket(code).is_some() {
        return false;
    }
    let begins = code.iter().rposition(|token| token.first_on_line).unwrap_or(0);
    let line = &code[begins..];
    let Some(first) = line.first() else { return false };
    let is_over = line.last().is_some_and(|last| text[last.to..].contains('\n'));
    let is_name = |token: &Token| {
        let word = token.text(text);
        token.kind == Kind::Word && words::keyword(word).is_none()
    };
    !is_over && is_name(first) && line.iter().all(|token| token.kind == Kind::Word)
}

/// Returns the names that stand as arguments before the one being typed: no thing is given twice.
fn given<'t>(code: &[Token], text: &'t str) -> Vec<&'t str> {
    let Some(call) = called::around(code, text) else { return Vec::new() };
    let args = &code[call.name + 2..call.start.max(call.name + 2)];
    let alone = |i: usize| {
        let before = i.checked_sub(1).map_or("(", |i| args[i].text(text));
        let after = args.get(i + 1).map_or(",", |token| token.text(text));
        args[i].kind == Kind::Word && matches!(before, "(" | "," | ":") && after == ","
    };
    (0..args.len()).filter(|i| alone(*i)).map(|i| args[i].text(text)).collect()
}

/// Returns whether what stands after these tokens is asked, not done: an action may have the name of
/// something that is measured.
pub(super) fn is_asked(before: &[Token], text: &str) -> bool {
    matches!(context(before, text), Context::Value | Context::Argument(_))
}

/// Tells from the tokens before a place what may stand there.
fn context(code: &[Token], text: &str) -> Context {
    let said = |i: usize| code.get(i).map_or("", |token: &Token| token.text(text));
    let Some(last) = code.len().checked_sub(1) else { return Context::Top };
    let open = called::open_bracket(code);
    let call = called::around(code, text);
    let argument = |call: &called::Around| Given {
        call: said(call.name).to_owned(),
        at: call.argument,
        name: (said(call.start + 1) == ":").then(|| said(call.start).to_owned()),
    };
    if code[last].kind == Kind::Number {
        // What is multiplied or compared may be of any kind.
        let is_whole = matches!(said(last.wrapping_sub(1)), "(" | "," | ":" | "|" | "+" | "-");
        let call = call.filter(|call| is_whole && !called::defines(code, call.name, text));
        return Context::Unit(call.as_ref().map(argument));
    }
    if let Some(call) = call {
        if called::defines(code, call.name, text) {
            return if said(last) == ":" { Context::Type } else { Context::Nothing };
        }
        if operand_ends(said(last), code[last].kind) {
            return Context::Nothing;
        }
        return Context::Argument(argument(&call));
    }
    match said(last) {
        "via" => {
            // The call before: its name stands before its parenthesis.
            let mut depth = 0_i32;
            let open = (0..last).rev().find(|i| {
                match code[*i].kind {
                    Kind::Close => depth += 1,
                    Kind::Open => depth -= 1,
                    _ => {}
                }
                depth == 0
            });
            let name = open.and_then(|open| open.checked_sub(1)).map(|i| said(i).to_owned());
            name.map_or(Context::Nothing, Context::Branch)
        }
        // After a block it begins a branch, which has a name of its own; elsewhere it joins conditions.
        "or" if open.is_none_or(|open| said(open) == "{") && said(last.wrapping_sub(1)) == "}" => {
            Context::Nothing
        }
        "check" | "needs" | "keeps" | "gives" | "if" | "while" | "until" | "when" | "not"
        | "or" | "and" | "within" | "=" | "==" | "!=" | "<" | ">" | "<=" | ">=" | "+" | "-"
        | "*" | "/" | "(" => Context::Value,
        "then" | "{" | "}" => Context::Step,
        ":" => Context::Type,
        "task" | "action" | "fluent" | "type" | "scene" | "twin" | "model" | "let" | "as"
        | "either" | "prior" | "upto" | "import" | "say" | "run" | "ask" | "limit" | "timing" => {
            Context::Nothing
        }
        _ if open.is_none() => Context::Top,
        _ => Context::Step,
    }
}

/// Whether a value has just been completed, so that none can begin.
fn operand_ends(said: &str, kind: Kind) -> bool {
    match kind {
        Kind::Word => !matches!(said, "and" | "or" | "not" | "within"),
        Kind::Text | Kind::Number => true,
        Kind::Close => said == ")",
        _ => false,
    }
}

struct Finder<'a> {
    place: &'a Place<'a>,
    program: &'a Program,
    found: Vec<Completion>,
}

impl Finder<'_> {
    fn find(mut self, context: &Context) -> Vec<Completion> {
        match context {
            Context::Nothing => {}
            Context::Sentence => {
                let names: Vec<String> = self.place.scope.objects.keys().cloned().collect();
                for name in names {
                    self.described(&name, CompletionKind::Object, &name);
                }
            }
            Context::Top => {
                self.callables();
                self.keywords(words::ITEMS);
                self.keywords(words::STARTERS);
            }
            Context::Step => {
                self.callables();
                self.keywords(words::STARTERS);
            }
            Context::Value => {
                self.locals(None);
                self.fluents();
                self.objects(None);
                self.keywords(&["not", "true", "false"]);
            }
            Context::Argument(given) => self.argument(given),
            Context::Type => self.types(),
            Context::Branch(name) => self.branches(name),
            Context::Unit(given) => {
                let wanted = given.as_ref().and_then(|given| self.wanted(given));
                for (name, _, dimension) in crate::units::UNITS {
                    if matches!(&wanted, Some(Ty::Quantity(wanted)) if wanted != dimension) {
                        continue;
                    }
                    let doc = words::unit(name).unwrap_or_default();
                    self.offer(name, CompletionKind::Unit, &doc, "", name);
                }
            }
        }
        self.found
    }

    fn offer(&mut self, label: &str, kind: CompletionKind, detail: &str, doc: &str, insert: &str) {
        if self.found.iter().any(|known| known.label == label) {
            return;
        }
        self.found.push(Completion {
            label: label.to_owned(),
            kind,
            detail: detail.to_owned(),
            doc: doc.to_owned(),
            insert: insert.to_owned(),
        });
    }

    /// Offers something by what [`describe`] says of it.
    fn described(&mut self, name: &str, kind: CompletionKind, insert: &str) {
        let said = describe(self.place.library, self.place.scope, name).unwrap_or_default();
        let (detail, doc) = said.split_once('\n').unwrap_or((&said, ""));
        self.offer(name, kind, detail, doc, insert);
    }

    fn callables(&mut self) {
        let library = self.place.library;
        let tasks = library.tasks().map(|(task, _)| (&task.name.text, CompletionKind::Task));
        let actions = library.actions().map(|(a, _)| (&a.name.text, CompletionKind::Action));
        let all: Vec<_> = tasks.chain(actions).map(|(name, kind)| (name.clone(), kind)).collect();
        for (name, kind) in all {
            self.described(&name, kind, &format!("{name}("));
        }
    }

    fn fluents(&mut self) {
        let library: &Library = self.place.library;
        let own = library.fluents().map(|(fluent, _)| fluent.name.text.clone());
        let built_in = builtins::FUNCTIONS.iter().map(|function| function.name.to_owned());
        for name in own.chain(built_in).collect::<Vec<_>>() {
            self.described(&name, CompletionKind::Fluent, &format!("{name}("));
        }
    }

    /// Places that are told by their relation to things, or by numbers.
    fn places(&mut self) {
        for function in builtins::FUNCTIONS.iter().filter(|f| Ty::named(f.result) == Ty::Place) {
            self.described(function.name, CompletionKind::Fluent, &format!("{}(", function.name));
        }
    }

    fn objects(&mut self, wanted: Option<&Ty>) {
        let objects: Vec<_> = self.place.scope.objects.clone().into_iter().collect();
        let constants =
            builtins::CONSTANTS.iter().map(|(name, ty, _)| ((*name).to_owned(), (*ty).to_owned()));
        for (name, ty) in objects.into_iter().chain(constants) {
            if self.fits(&Ty::named(&ty), wanted) {
                self.described(&name, CompletionKind::Object, &name);
            }
        }
    }

    fn locals(&mut self, wanted: Option<&Ty>) {
        for (name, ty) in locals(self.program, self.place.at) {
            if self.fits(&Ty::named(&ty), wanted) {
                self.offer(&name, CompletionKind::Local, &format!("{name}: {ty}"), "", &name);
            }
        }
    }

    fn fits(&self, ty: &Ty, wanted: Option<&Ty>) -> bool {
        match (wanted, ty) {
            (None | Some(Ty::Any), _) | (Some(Ty::Place), Ty::Object(_)) => true,
            (Some(Ty::Object(wanted)), Ty::Object(ty)) => self.place.library.is_a(ty, wanted),
            (Some(wanted), ty) => wanted == ty,
        }
    }

    /// Returns name and type of each parameter of what is called.
    fn params(&self, name: &str) -> Vec<(String, String)> {
        let library = self.place.library;
        let callable = library.callable(name).map(|(callable, _)| callable.params().to_vec());
        let own =
            callable.or_else(|| library.fluent(name).map(|(fluent, _)| fluent.params.clone()));
        match own {
            Some(params) => {
                params.iter().map(|p| (p.name.text.clone(), p.ty.text.clone())).collect()
            }
            None => builtins::function(name).map_or_else(Vec::new, |function| {
                let all = function.params.iter();
                all.map(|(name, ty)| ((*name).to_owned(), (*ty).to_owned())).collect()
            }),
        }
    }

    /// Returns the type that an argument is to have, if there is such an argument.
    fn wanted(&self, given: &Given) -> Option<Ty> {
        let params = self.params(&given.call);
        let param = match &given.name {
            Some(named) => params.iter().find(|(name, _)| name == named),
            None => params.get(given.at),
        };
        param.map(|(_, ty)| Ty::named(ty))
    }

    /// Values for one argument, then the names of the parameters not yet given.
    fn argument(&mut self, given: &Given) {
        let Some(ty) = self.wanted(given) else { return };
        self.locals(Some(&ty));
        self.objects(Some(&ty));
        match ty {
            Ty::Quantity(_) => self.fluents(),
            Ty::Place => self.places(),
            _ => {}
        }
        if given.name.is_none() {
            for (name, ty) in self.params(&given.call).iter().skip(given.at) {
                let label = format!("{name}:");
                let detail = format!("{name}: {ty}");
                let insert = format!("{name}: ");
                self.offer(&label, CompletionKind::Parameter, &detail, "", &insert);
            }
        }
    }

    fn types(&mut self) {
        let names: Vec<String> = self.place.library.type_names().map(str::to_owned).collect();
        let built_in = builtins::TYPES.iter().map(|(name, _)| (*name).to_owned());
        for name in names.into_iter().chain(built_in) {
            self.described(&name, CompletionKind::Type, &name);
        }
        for name in Dimension::names() {
            let units = Dimension::named(name).map(|d| words::units(d).collect::<Vec<_>>());
            let detail = format!("type {name}: {}", units.unwrap_or_default().join(" "));
            self.offer(name, CompletionKind::Type, &detail, "", name);
        }
    }

    fn branches(&mut self, name: &str) {
        for branch in super::super::check::branches(self.place.library, name) {
            let detail = format!("a branch of {name}");
            self.offer(&branch, CompletionKind::Branch, &detail, "", &branch);
        }
    }

    fn keywords(&mut self, all: &[&str]) {
        for word in all {
            let first = word.split(' ').next().unwrap_or(word);
            let said = words::keyword(first).unwrap_or_default();
            let (detail, doc) = said.split_once('\n').unwrap_or((said, ""));
            self.offer(word, CompletionKind::Keyword, detail, doc, word);
        }
    }
}
