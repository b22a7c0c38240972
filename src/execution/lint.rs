//! What is wrong with a script, as far as that shows without running it: what cannot be read, words and names that there
//! are not, words with more than they take.
//!
//! Nothing is known of the types of values, so of a value's words it is only asked whether anything has such a word.

use std::collections::BTreeSet;

use rhai::{AST, ASTNode, Expr, FnCallExpr, ParseErrorType, Position, Scope, Stmt};

use crate::language::nearest;
use crate::language::script_words::{ScriptWord, WORDS, words_of};

use super::bounds;
use super::refusal::Mistake;
use super::script::{ScriptError, UNITS};

/// What a script sees beside units and parameters.
const HANDLES: [&str; 3] = ["camera", "twin", "arm"];
/// What stands before a word of a value that is no handle.
const VALUE: &str = "value";
/// Words of the engine itself, which are in no list of functions.
const ENGINE: [&str; 9] =
    ["Fn", "call", "curry", "debug", "is_def_fn", "is_def_var", "is_shared", "print", "type_of"];

/// Reads the script `text` of file `file`, for an action with these parameters.
///
/// # Errors
///
/// [`ScriptError::Wrong`] with the line of what is wrong.
pub fn readable<'p>(
    file: &str,
    text: &str,
    params: impl IntoIterator<Item = &'p str>,
) -> Result<(), ScriptError> {
    let wrong = |(position, mistake): (Position, Mistake)| ScriptError::Wrong {
        file: file.to_owned(),
        line: position.line().unwrap_or(0),
        mistake,
    };
    let mut engine = bounds::engine();
    engine.set_strict_variables(true);
    // Of what is never done the words are looked at, too.
    engine.set_optimization_level(rhai::OptimizationLevel::None);
    let mut scope = Scope::new();
    let known = HANDLES.into_iter().chain(UNITS.iter().map(|(unit, _)| *unit)).chain(params);
    for name in known {
        scope.push(name, ());
    }
    let tree = engine.compile_with_scope(&scope, text).map_err(|error| {
        let mistake = match error.err_type() {
            ParseErrorType::VariableUndefined(name) => no_name(name, &scope),
            other => Mistake::Engine(other.to_string()),
        };
        wrong((error.position(), mistake))
    })?;
    let name = |known: rhai::FuncInfo<'_>| Some(known.metadata.name.to_string());
    let mut functions: BTreeSet<String> =
        engine.collect_fn_metadata(None, name, true).into_iter().collect();
    functions.extend(ENGINE.map(str::to_owned));
    functions.extend(tree.iter_functions().map(|function| function.name.to_owned()));
    functions.extend(fields(&tree));
    misspelt(&tree, &functions).map_or(Ok(()), |found| Err(wrong(found)))
}

/// Returns the names of parts of maps, which may be functions.
fn fields(tree: &AST) -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    tree.walk(&mut |path: &[ASTNode<'_>]| {
        match path.last() {
            Some(ASTNode::Expr(Expr::Map(map, _))) => {
                found.extend(map.0.iter().map(|(name, _)| name.name.to_string()));
            }
            Some(ASTNode::Expr(Expr::Property(property, _))) => {
                found.insert(property.2.to_string());
            }
            _ => {}
        }
        true
    });
    found
}

/// Returns the first call of a word that there is not, or with more than it takes.
fn misspelt(tree: &AST, functions: &BTreeSet<String>) -> Option<(Position, Mistake)> {
    let mut found = None;
    tree.walk(&mut |path: &[ASTNode<'_>]| {
        let called = match path.last() {
            Some(ASTNode::Expr(Expr::FnCall(call, at)) | ASTNode::Stmt(Stmt::FnCall(call, at))) => {
                Some(("", call, *at))
            }
            Some(ASTNode::Expr(Expr::MethodCall(call, at))) => {
                Some((receiver(path, call), call, *at))
            }
            _ => None,
        };
        if let Some((of, call, at)) = called {
            found = mistake(of, call, functions).map(|mistake| (at, mistake));
        }
        found.is_none()
    });
    found
}

/// Returns the handle whose word is called, or [`VALUE`] for any other value.
fn receiver<'a>(path: &'a [ASTNode<'_>], call: &FnCallExpr) -> &'a str {
    for node in path.iter().rev() {
        let ASTNode::Expr(Expr::Dot(both, ..)) = node else { continue };
        let Expr::Variable(variable, ..) = &both.lhs else { continue };
        let is_first = first(&both.rhs).is_some_and(|first| std::ptr::eq(first, call));
        let is_handle = is_first && HANDLES.contains(&variable.1.as_str());
        return if is_handle { variable.1.as_str() } else { VALUE };
    }
    VALUE
}

/// Returns the call that a chain of words begins with.
fn first(chain: &Expr) -> Option<&FnCallExpr> {
    match chain {
        Expr::MethodCall(call, _) => Some(call),
        Expr::Dot(both, ..) | Expr::Index(both, ..) => first(&both.lhs),
        _ => None,
    }
}

/// Says what is wrong with a call of a handle's word, of a value's, or of one that stands alone.
fn mistake(of: &str, call: &FnCallExpr, functions: &BTreeSet<String>) -> Option<Mistake> {
    let name = call.name.as_str();
    if call.op_token.is_some() || call.is_qualified() || functions.contains(name) {
        return None;
    }
    let same: Vec<&ScriptWord> = WORDS.iter().filter(|word| word.name == name).collect();
    // A word that stands alone may be called on its first argument, and a value's word as if it stood alone.
    let is_handle = HANDLES.contains(&of);
    let here = same.iter().find(|word| word.of == of).or_else(|| {
        let mut values = same.iter().filter(|word| !HANDLES.contains(&word.of));
        if is_handle { None } else { values.next() }
    });
    if let Some(word) = here {
        let takes = word.takes.map_or(0, |takes| takes.split_terminator(", ").count());
        let too_many = word.of == of && call.args.len() > takes;
        return too_many.then(|| Mistake::Misused { written: word.written() });
    }
    let own = words_of(of).chain(WORDS.iter()).map(|word| word.name);
    let meant = same.first().copied().or_else(|| {
        let near = nearest(name, own)?;
        words_of(of).chain(WORDS).find(|word| word.name == near)
    });
    let name = if is_handle { format!("{of}.{name}") } else { name.to_owned() };
    Some(match meant {
        Some(word) => Mistake::Unknown { name, meant: word.written() },
        None => Mistake::NoWord { name },
    })
}

/// Says that there is no such name.
fn no_name(name: &str, scope: &Scope<'_>) -> Mistake {
    let known = scope.iter_raw().map(|(known, ..)| known);
    match nearest(name, known) {
        Some(meant) => Mistake::Unknown { name: name.to_owned(), meant: meant.to_owned() },
        None => Mistake::NoWord { name: name.to_owned() },
    }
}
