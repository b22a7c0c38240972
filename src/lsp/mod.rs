//! The language server: what an editor asks while somebody writes a `.task` file.
//!
//! Diagnostics and their fixes, completion, hover, signatures, outline, definitions, references, renaming and
//! formatting, over a [`Connection`]; what names mean in more than one text is in `names`. Every answer is one
//! function of [`crate::language::assist`] or of [`crate::workcell::check`], which the prompt and `trueup check` ask
//! as well. Texts are whatever the editor holds, half-typed or not; nothing here knows a robot. One thread, one
//! request at a time: every answer takes milliseconds.
//!
//! Source: the Language Server Protocol 3.17; framing and types are `lsp-server` and `lsp-types`.

mod names;
mod position;

use std::cell::{OnceCell, RefCell};
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::rc::Rc;

use lsp_server::{Connection, ErrorCode, Message, Notification, Request, Response};
use lsp_types::{
    CodeActionKind, CodeActionOptions, CodeActionProviderCapability, CompletionItem,
    CompletionItemKind, CompletionOptions, DiagnosticRelatedInformation, DiagnosticSeverity,
    Documentation, HoverContents, HoverProviderCapability, Location, MarkupContent, MarkupKind,
    NumberOrString, OneOf, ParameterInformation, ParameterLabel, PublishDiagnosticsParams,
    RenameOptions, ServerCapabilities, SignatureHelp, SignatureHelpOptions, SignatureInformation,
    SymbolKind, TextDocumentPositionParams, TextDocumentSyncCapability, TextDocumentSyncKind,
    TextEdit, Uri, WorkDoneProgressOptions,
};
use serde_json::Value;

use crate::files::read::{TEXT, text_of};
use crate::files::write;
use crate::language::assist::{self, CompletionKind, Place, Symbol};
use crate::language::{self, Diagnostic, Fix, Library, Scope, Severity, Source};
use crate::workcell::{Stdlib, check, library};
use position::{offset, range, whole};

/// Why the server ended before it was asked to.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The editor broke the protocol or went away.
    #[error("the editor and the language server lost each other: {0}")]
    Protocol(String),
}

/// Where definitions outside of the editor's own texts can be gone to.
#[derive(Debug, Clone, Default)]
pub struct Places {
    /// The user's stdlib folder, if there is one.
    pub folder: Option<PathBuf>,
    /// Where copies of the embedded stdlib may be put, a folder of this version of the program.
    pub cache: Option<PathBuf>,
}

/// Serves one editor until it says goodbye.
///
/// `places` are where definitions can be gone to.
///
/// # Errors
///
/// [`Error::Protocol`] when the connection breaks.
pub fn serve(connection: &Connection, stdlib: &Stdlib, places: Places) -> Result<(), Error> {
    let lost = |error: &dyn std::fmt::Display| Error::Protocol(error.to_string());
    let capabilities = serde_json::to_value(capabilities()).map_err(|e| lost(&e))?;
    connection.initialize(capabilities).map_err(|e| lost(&e))?;
    let mut server = Server {
        connection,
        stdlib,
        places,
        standard: library(stdlib),
        texts: BTreeMap::new(),
        read: RefCell::default(),
    };
    for message in &connection.receiver {
        match message {
            Message::Request(request) => {
                if connection.handle_shutdown(&request).map_err(|e| lost(&e))? {
                    return Ok(());
                }
                server.answer(request)?;
            }
            Message::Notification(notification) => server.hear(notification)?,
            Message::Response(_) => {}
        }
    }
    Ok(())
}

fn capabilities() -> ServerCapabilities {
    ServerCapabilities {
        text_document_sync: Some(TextDocumentSyncCapability::Kind(TextDocumentSyncKind::FULL)),
        completion_provider: Some(CompletionOptions {
            trigger_characters: Some(vec!["(".into(), ",".into(), ":".into(), " ".into()]),
            ..CompletionOptions::default()
        }),
        hover_provider: Some(HoverProviderCapability::Simple(true)),
        definition_provider: Some(OneOf::Left(true)),
        signature_help_provider: Some(SignatureHelpOptions {
            trigger_characters: Some(vec!["(".into(), ",".into()]),
            ..SignatureHelpOptions::default()
        }),
        document_symbol_provider: Some(OneOf::Left(true)),
        references_provider: Some(OneOf::Left(true)),
        rename_provider: Some(OneOf::Right(RenameOptions {
            prepare_provider: Some(true),
            work_done_progress_options: WorkDoneProgressOptions::default(),
        })),
        code_action_provider: Some(CodeActionProviderCapability::Options(CodeActionOptions {
            code_action_kinds: Some(vec![CodeActionKind::QUICKFIX]),
            ..CodeActionOptions::default()
        })),
        document_formatting_provider: Some(OneOf::Left(true)),
        ..ServerCapabilities::default()
    }
}

struct Server<'a> {
    connection: &'a Connection,
    stdlib: &'a Stdlib,
    places: Places,
    standard: Library,
    /// What the editor holds, by address.
    texts: BTreeMap<String, String>,
    /// What was read since the editor last changed anything, by address: it asks several things of one text.
    read: RefCell<BTreeMap<String, Rc<Open>>>,
}

/// A text read into a library of its own.
struct Open {
    library: Library,
    file: usize,
    scope: Scope,
    /// What is wrong with it, once somebody asked.
    wrong: OnceCell<Vec<Diagnostic>>,
}

impl Server<'_> {
    fn send(&self, message: impl Into<Message>) -> Result<(), Error> {
        self.connection.sender.send(message.into()).map_err(|e| Error::Protocol(e.to_string()))
    }

    /// Takes note of what the editor holds, and tells what is wrong with it.
    fn hear(&mut self, notification: Notification) -> Result<(), Error> {
        let Notification { method, params, .. } = notification;
        self.read.get_mut().clear();
        let document = &params["textDocument"];
        let Some(uri) = document["uri"].as_str().map(str::to_owned) else { return Ok(()) };
        let text = match method.as_str() {
            "textDocument/didOpen" => document["text"].as_str().map(str::to_owned),
            "textDocument/didChange" => {
                let changes = params["contentChanges"].as_array();
                let last = changes.and_then(|changes| changes.last());
                last.and_then(|change| change["text"].as_str()).map(str::to_owned)
            }
            "textDocument/didClose" => {
                self.texts.remove(&uri);
                return self.publish(&uri, Vec::new());
            }
            _ => return Ok(()),
        };
        let Some(text) = text else { return Ok(()) };
        self.texts.insert(uri.clone(), text);
        let diagnostics = self.diagnostics(&uri);
        self.publish(&uri, diagnostics)
    }

    fn publish(&self, uri: &str, diagnostics: Vec<lsp_types::Diagnostic>) -> Result<(), Error> {
        let Ok(uri) = uri.parse::<Uri>() else { return Ok(()) };
        let params = PublishDiagnosticsParams { uri, diagnostics, version: None };
        self.send(Notification::new("textDocument/publishDiagnostics".into(), params))
    }

    fn answer(&self, request: Request) -> Result<(), Error> {
        let Request { id, method, params } = request;
        let found = match method.as_str() {
            "textDocument/completion" => self.at(&params).map(|at| self.completion(&at)),
            "textDocument/hover" => self.at(&params).map(|at| self.hover(&at)),
            "textDocument/definition" => self.at(&params).map(|at| self.definition(&at)),
            "textDocument/formatting" => Some(self.formatting(&params)),
            "textDocument/signatureHelp" => self.at(&params).map(|at| self.signature(&at)),
            "textDocument/documentSymbol" => Some(self.symbols(&params)),
            "textDocument/codeAction" => Some(self.fixes(&params)),
            "textDocument/references" => self.at(&params).map(|at| self.references(&at, &params)),
            "textDocument/prepareRename" => self.at(&params).map(|at| self.renamable(&at)),
            "textDocument/rename" => match self.at(&params).map(|at| self.renamed(&at, &params)) {
                Some(Err(why)) => {
                    let code = ErrorCode::RequestFailed as i32;
                    return self.send(Response::new_err(id, code, why.to_string()));
                }
                answered => answered.and_then(Result::ok),
            },
            method => {
                let code = ErrorCode::MethodNotFound as i32;
                let words = format!("`{method}` is not answered");
                return self.send(Response::new_err(id, code, words));
            }
        };
        // A text the editor never opened has no answer, which is no error.
        self.send(Response::new_ok(id, found.unwrap_or(Value::Null)))
    }

    /// Returns the text and the byte that a request is about.
    fn at(&self, params: &Value) -> Option<(String, usize)> {
        let position: TextDocumentPositionParams = serde_json::from_value(params.clone()).ok()?;
        let uri = position.text_document.uri.as_str().to_owned();
        let at = offset(self.texts.get(&uri)?, position.position);
        Some((uri, at))
    }

    fn open(&self, uri: &str) -> Rc<Open> {
        if let Some(open) = self.read.borrow().get(uri) {
            return open.clone();
        }
        let mut library = self.standard.clone();
        let text = self.texts.get(uri).cloned().unwrap_or_default();
        let source = Source::new(path_of(uri), text);
        let file = library.add_with(source, &|path| self.stdlib.read(path));
        let scope = check::scope_of(&library, file);
        let open = Rc::new(Open { library, file, scope, wrong: OnceCell::new() });
        self.read.borrow_mut().insert(uri.to_owned(), open.clone());
        open
    }

    fn text(&self, uri: &str) -> &str {
        self.texts.get(uri).map(String::as_str).unwrap_or_default()
    }

    fn wrong<'o>(&self, open: &'o Open) -> &'o [Diagnostic] {
        open.wrong
            .get_or_init(|| check::check_file(&open.library, self.stdlib, open.file, &open.scope))
    }

    fn diagnostics(&self, uri: &str) -> Vec<lsp_types::Diagnostic> {
        let text = self.text(uri);
        self.wrong(&self.open(uri))
            .iter()
            .map(|diagnostic| diagnosed(diagnostic, uri, text))
            .collect()
    }

    /// Returns the fixes of the mistakes that a stretch of text touches.
    fn fixes(&self, params: &Value) -> Value {
        let uri = params["textDocument"]["uri"].as_str().unwrap_or_default();
        let text = self.text(uri);
        let asked: Option<lsp_types::Range> = serde_json::from_value(params["range"].clone()).ok();
        let Some(asked) = asked else { return Value::Null };
        let touches =
            |found: &lsp_types::Range| found.start <= asked.end && asked.start <= found.end;
        let open = self.open(uri);
        let fixes = self.wrong(&open).iter().filter_map(|diagnostic| {
            let fix = diagnostic.fix.as_ref()?;
            let told = diagnosed(diagnostic, uri, text);
            let edit = TextEdit { range: range(text, fix.span), new_text: fix.text.clone() };
            touches(&told.range).then(|| {
                serde_json::json!({
                    "title": title(fix, text),
                    "kind": CodeActionKind::QUICKFIX,
                    "diagnostics": [told],
                    "isPreferred": true,
                    "edit": {"changes": {uri: [edit]}},
                })
            })
        });
        fixes.collect()
    }

    fn signature(&self, (uri, at): &(String, usize)) -> Value {
        let open = self.open(uri);
        let place =
            Place { library: &open.library, scope: &open.scope, text: self.text(uri), at: *at };
        let Some(called) = assist::called(&place) else { return Value::Null };
        let parameter = |param: String| ParameterInformation {
            label: ParameterLabel::Simple(param),
            documentation: None,
        };
        serde_json::json!(SignatureHelp {
            signatures: vec![SignatureInformation {
                label: called.signature,
                documentation: (!called.doc.is_empty())
                    .then_some(Documentation::String(called.doc)),
                parameters: Some(called.params.into_iter().map(parameter).collect()),
                active_parameter: None,
            }],
            active_signature: Some(0),
            active_parameter: called.active.and_then(|at| u32::try_from(at).ok()),
        })
    }

    fn symbols(&self, params: &Value) -> Value {
        let uri = params["textDocument"]["uri"].as_str().unwrap_or_default();
        let text = self.text(uri);
        assist::outline(text).iter().map(|found| symbol(found, text)).collect()
    }

    fn completion(&self, (uri, at): &(String, usize)) -> Value {
        let open = self.open(uri);
        let text = self.texts.get(uri).map(String::as_str).unwrap_or_default();
        let place = Place { library: &open.library, scope: &open.scope, text, at: *at };
        let offers = assist::complete(&place).into_iter().enumerate().map(|(i, offer)| {
            CompletionItem {
                label: offer.label,
                kind: Some(kind(offer.kind)),
                detail: Some(offer.detail),
                documentation: (!offer.doc.is_empty()).then_some(Documentation::String(offer.doc)),
                insert_text: Some(offer.insert),
                // The order says what fits best; editors sort by letters unless told.
                sort_text: Some(format!("{i:04}")),
                ..CompletionItem::default()
            }
        });
        serde_json::json!(offers.collect::<Vec<_>>())
    }

    fn hover(&self, (uri, at): &(String, usize)) -> Value {
        let open = self.open(uri);
        let text = self.texts.get(uri).map(String::as_str).unwrap_or_default();
        let place = Place { library: &open.library, scope: &open.scope, text, at: *at };
        let Some(found) = assist::hover(&place) else { return Value::Null };
        let (head, rest) = found.text.split_once('\n').unwrap_or((&found.text, ""));
        let value = format!("```task\n{head}\n```\n```text\n{rest}\n```");
        serde_json::json!(lsp_types::Hover {
            contents: HoverContents::Markup(MarkupContent { kind: MarkupKind::Markdown, value }),
            range: Some(range(text, found.span)),
        })
    }

    fn definition(&self, (uri, at): &(String, usize)) -> Value {
        let open = self.open(uri);
        let text = self.texts.get(uri).map(String::as_str).unwrap_or_default();
        let place = Place { library: &open.library, scope: &open.scope, text, at: *at };
        let Some(found) = assist::definition(&place) else { return Value::Null };
        let here = found.file.is_empty() || found.file == path_of(uri);
        let (target, source) = if here {
            (uri.clone(), text.to_owned())
        } else {
            let Some(source) = open.library.source_named(&found.file) else { return Value::Null };
            let Some(path) = self.file(&found.file) else { return Value::Null };
            (address_of(&path), source.text.clone())
        };
        let Ok(uri) = target.parse::<Uri>() else { return Value::Null };
        serde_json::json!(Location { uri, range: range(&source, found.span) })
    }

    /// Returns the path of a source: in the user's stdlib folder, imported, or a copy of what is embedded.
    fn file(&self, name: &str) -> Option<PathBuf> {
        let of_folder = self.places.folder.as_ref().map(|folder| folder.join(name));
        let known = of_folder.filter(|path| path.is_file());
        if let Some(path) = known.and_then(|path| path.canonicalize().ok()) {
            return Some(path);
        }
        match self.stdlib.file(name) {
            Some(text) => self.copy(name, text),
            None => PathBuf::from(name).canonicalize().ok(),
        }
    }

    /// Puts a text that is embedded in the program where an editor can go, and returns its path. The copy is
    /// for reading: what is written into it is gone when it is gone to again.
    fn copy(&self, name: &str, text: &str) -> Option<PathBuf> {
        let path = self.places.cache.as_ref()?.join(name);
        if text_of(&path, TEXT).ok().as_deref() != Some(text) {
            fs::create_dir_all(path.parent()?).ok()?;
            // Not being able to go there is no answer, which is no error.
            write::place(&path, text).ok()?;
        }
        path.canonicalize().ok()
    }

    fn formatting(&self, params: &Value) -> Value {
        let uri = params["textDocument"]["uri"].as_str().unwrap_or_default();
        let Some(text) = self.texts.get(uri) else { return Value::Null };
        let new_text = language::format(text);
        if new_text == *text {
            return serde_json::json!([]);
        }
        serde_json::json!([TextEdit { range: whole(text), new_text }])
    }
}

/// Says what a fix does.
fn title(fix: &Fix, text: &str) -> String {
    let was = text.get(fix.span.from..fix.span.to).unwrap_or_default();
    match (was.trim(), fix.text.trim()) {
        (was, "") => format!("remove `{was}`"),
        ("", new) => format!("insert `{new}`"),
        (was, new) => format!("`{new}` instead of `{was}`"),
    }
}

fn symbol(found: &Symbol, text: &str) -> Value {
    let kind = match found.kind {
        assist::SymbolKind::Type => SymbolKind::CLASS,
        assist::SymbolKind::Fluent => SymbolKind::PROPERTY,
        assist::SymbolKind::Action => SymbolKind::METHOD,
        assist::SymbolKind::Task => SymbolKind::FUNCTION,
        assist::SymbolKind::Scene => SymbolKind::NAMESPACE,
        assist::SymbolKind::Thing => SymbolKind::CONSTANT,
        assist::SymbolKind::Twin | assist::SymbolKind::Model => SymbolKind::STRUCT,
    };
    serde_json::json!({
        "name": found.name,
        "kind": kind,
        "range": range(text, found.span),
        "selectionRange": range(text, found.at),
        "children": found.within.iter().map(|inner| symbol(inner, text)).collect::<Vec<_>>(),
    })
}

fn kind(kind: CompletionKind) -> CompletionItemKind {
    match kind {
        CompletionKind::Task | CompletionKind::Action => CompletionItemKind::FUNCTION,
        CompletionKind::Fluent => CompletionItemKind::PROPERTY,
        CompletionKind::Object => CompletionItemKind::CONSTANT,
        CompletionKind::Local | CompletionKind::Parameter => CompletionItemKind::VARIABLE,
        CompletionKind::Type => CompletionItemKind::CLASS,
        CompletionKind::Branch => CompletionItemKind::ENUM_MEMBER,
        CompletionKind::Unit => CompletionItemKind::UNIT,
        CompletionKind::Keyword => CompletionItemKind::KEYWORD,
    }
}

fn diagnosed(diagnostic: &Diagnostic, uri: &str, text: &str) -> lsp_types::Diagnostic {
    let message = match &diagnostic.help {
        Some(help) => format!("{}\nhelp: {help}", diagnostic.message),
        None => diagnostic.message.clone(),
    };
    let further = diagnostic.labels.iter().skip(1).filter_map(|label| {
        let location = Location { uri: uri.parse().ok()?, range: range(text, label.span) };
        Some(DiagnosticRelatedInformation { location, message: label.text.clone() })
    });
    let further: Vec<_> = further.collect();
    lsp_types::Diagnostic {
        range: range(text, diagnostic.span),
        severity: Some(match diagnostic.severity {
            Severity::Error => DiagnosticSeverity::ERROR,
            Severity::Warning => DiagnosticSeverity::WARNING,
        }),
        code: Some(NumberOrString::String(diagnostic.code.into())),
        source: Some("trueup".into()),
        message,
        related_information: (!further.is_empty()).then_some(further),
        ..lsp_types::Diagnostic::default()
    }
}

/// `file:///a/b%20c.task` → `/a/b c.task`; any other address stays as it is.
fn path_of(uri: &str) -> String {
    let Some(path) = uri.strip_prefix("file://") else { return uri.to_owned() };
    let mut bytes = Vec::new();
    let mut rest = path.as_bytes();
    while let [first, after @ ..] = rest {
        let hex = (*first == b'%')
            .then(|| after.get(..2))
            .flatten()
            .and_then(|two| std::str::from_utf8(two).ok())
            .and_then(|two| u8::from_str_radix(two, 16).ok());
        if let Some(byte) = hex {
            bytes.push(byte);
            rest = &after[2..];
        } else {
            bytes.push(*first);
            rest = after;
        }
    }
    String::from_utf8_lossy(&bytes).into_owned()
}

/// `/a/b c.task` → `file:///a/b%20c.task`.
fn address_of(path: &Path) -> String {
    let mut out = String::from("file://");
    for byte in path.to_string_lossy().bytes() {
        match byte {
            b'a'..=b'z' | b'A'..=b'Z' | b'0'..=b'9' | b'/' | b'-' | b'_' | b'.' | b'~' => {
                out.push(char::from(byte));
            }
            byte => {
                let _ = write!(out, "%{byte:02X}");
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_and_paths_lead_to_each_other() {
        for path in ["/a/b c.task", "/ä/%/x.task"] {
            assert_eq!(path_of(&address_of(Path::new(path))), path);
        }
        assert_eq!(path_of("untitled:1"), "untitled:1");
        assert_eq!(path_of("file:///a%2"), "/a%2");
    }
}
