//! Where a name is used in the texts that an editor holds, and what renaming it changes.
//!
//! What is defined in the standard library or in a file that is not open is found, and not renamed: the change would stay
//! in a copy, or leave texts behind that nobody looked through.

use lsp_types::{Location, TextEdit, Uri};
use serde_json::{Value, json};

use super::position::range;
use super::{Server, path_of};
use crate::language::assist::{self, Definition, Place};
use crate::language::ast::Span;

/// Why a name is not renamed.
#[derive(Debug, thiserror::Error)]
pub(super) enum Refused {
    #[error("nothing is defined here that could be renamed")]
    Nothing,
    #[error("`{0}` is defined in {1}, which is not open here")]
    Elsewhere(String, String),
    #[error("`{0}` is not a name: lower-case letters, digits and `_`, a letter first")]
    NoName(String),
    #[error("there is a `{0}` already")]
    Taken(String),
}

/// A name as it is meant at a place.
struct Meant {
    word: String,
    span: Span,
    definition: Definition,
}

impl Server<'_> {
    fn meant(&self, (uri, at): &(String, usize)) -> Option<Meant> {
        let open = self.open(uri);
        let place =
            Place { library: &open.library, scope: &open.scope, text: self.text(uri), at: *at };
        let (word, span) = assist::word(&place)?;
        let definition = assist::meant(&place, &path_of(uri))?;
        Some(Meant { word: word.to_owned(), span, definition })
    }

    /// Returns the uses of a name, text by text.
    fn uses(&self, meant: &Meant) -> Vec<(String, Vec<Span>)> {
        let of = |uri: &String| {
            let open = self.open(uri);
            let text = self.text(uri);
            let place = Place { library: &open.library, scope: &open.scope, text, at: 0 };
            let found = assist::uses(&place, &meant.definition, &meant.word, &path_of(uri));
            (uri.clone(), found)
        };
        self.texts.keys().map(of).filter(|(_, found)| !found.is_empty()).collect()
    }

    pub(super) fn references(&self, at: &(String, usize), params: &Value) -> Value {
        let Some(meant) = self.meant(at) else { return Value::Null };
        let with_definition = params["context"]["includeDeclaration"].as_bool() != Some(false);
        let mut found = Vec::new();
        for (uri, spans) in self.uses(&meant) {
            let Ok(address) = uri.parse::<Uri>() else { continue };
            let is_definition = |span: &Span| {
                *span == meant.definition.span && path_of(&uri) == meant.definition.file
            };
            let wanted = spans.into_iter().filter(|span| with_definition || !is_definition(span));
            found.extend(wanted.map(|span| Location {
                uri: address.clone(),
                range: range(self.text(&uri), span),
            }));
        }
        json!(found)
    }

    /// Returns the name at a place, if it can be renamed.
    pub(super) fn renamable(&self, at: &(String, usize)) -> Value {
        match self.meant(at).filter(|meant| self.is_open(&meant.definition.file)) {
            Some(meant) => json!({
                "range": range(self.text(&at.0), meant.span),
                "placeholder": meant.word,
            }),
            None => Value::Null,
        }
    }

    fn is_open(&self, file: &str) -> bool {
        self.texts.keys().any(|uri| path_of(uri) == file)
    }

    pub(super) fn renamed(&self, at: &(String, usize), params: &Value) -> Result<Value, Refused> {
        let meant = self.meant(at).ok_or(Refused::Nothing)?;
        if !self.is_open(&meant.definition.file) {
            return Err(Refused::Elsewhere(meant.word, meant.definition.file));
        }
        let new = params["newName"].as_str().unwrap_or_default();
        if !assist::is_name(new) {
            return Err(Refused::NoName(new.to_owned()));
        }
        let open = self.open(&at.0);
        if assist::describe(&open.library, &open.scope, new).is_some() {
            return Err(Refused::Taken(new.to_owned()));
        }
        let mut changes = serde_json::Map::new();
        for (uri, spans) in self.uses(&meant) {
            let text = self.text(&uri);
            let edit = |span| TextEdit { range: range(text, span), new_text: new.to_owned() };
            changes.insert(uri.clone(), json!(spans.into_iter().map(edit).collect::<Vec<_>>()));
        }
        Ok(json!({ "changes": changes }))
    }
}
