//! The language server as an editor meets it: through pipes, and on texts nobody has finished.

use std::io::{BufRead, BufReader, Read, Write};
use std::process::{Child, ChildStdin, ChildStdout, Stdio};

use lsp_server::{Connection, Message, Notification, Request};
use serde_json::{Value, json};
use trueup::lsp::{Places, serve};
use trueup::workcell::Stdlib;

use crate::program::Scratch;

const URI: &str = "file:///scratch/mine.task";

/// A session with the built program.
struct Editor {
    child: Child,
    to: ChildStdin,
    from: BufReader<ChildStdout>,
    id: i64,
}

impl Editor {
    fn open(scratch: &Scratch) -> Self {
        let mut child =
            scratch.command(&["lsp"]).stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
        let (to, from) = (child.stdin.take().unwrap(), child.stdout.take().unwrap());
        let mut editor = Self { child, to, from: BufReader::new(from), id: 0 };
        let said = editor
            .ask("initialize", json!({"capabilities": {}, "processId": null, "rootUri": null}));
        assert_eq!(said["capabilities"]["hoverProvider"], true);
        editor.tell("initialized", json!({}));
        editor
    }

    fn send(&mut self, message: &Value) {
        let body = message.to_string();
        write!(self.to, "Content-Length: {}\r\n\r\n{body}", body.len()).unwrap();
        self.to.flush().unwrap();
    }

    fn hear(&mut self) -> Value {
        let mut length = 0;
        loop {
            let mut line = String::new();
            self.from.read_line(&mut line).unwrap();
            if line.trim().is_empty() {
                break;
            }
            if let Some(n) = line.strip_prefix("Content-Length: ") {
                length = n.trim().parse().unwrap();
            }
        }
        let mut body = vec![0; length];
        self.from.read_exact(&mut body).unwrap();
        serde_json::from_slice(&body).unwrap()
    }

    #[expect(clippy::needless_pass_by_value, reason = "callers write it in place")]
    fn tell(&mut self, method: &str, params: Value) {
        self.send(&json!({"jsonrpc": "2.0", "method": method, "params": params}));
    }

    #[expect(clippy::needless_pass_by_value, reason = "callers write it in place")]
    fn ask(&mut self, method: &str, params: Value) -> Value {
        self.id += 1;
        self.send(&json!({"jsonrpc": "2.0", "id": self.id, "method": method, "params": params}));
        loop {
            let heard = self.hear();
            if heard["id"] == self.id {
                assert!(heard.get("error").is_none(), "{heard}");
                return heard["result"].clone();
            }
        }
    }

    /// Opens or changes the text and returns what is wrong with it.
    fn write(&mut self, version: i64, text: &str) -> Vec<Value> {
        if version == 1 {
            let document = json!({"uri": URI, "languageId": "task", "version": 1, "text": text});
            self.tell("textDocument/didOpen", json!({ "textDocument": document }));
        } else {
            let document = json!({"uri": URI, "version": version});
            let changes = json!([{ "text": text }]);
            self.tell(
                "textDocument/didChange",
                json!({"textDocument": document, "contentChanges": changes}),
            );
        }
        let heard = self.hear();
        assert_eq!(heard["method"], "textDocument/publishDiagnostics");
        assert_eq!(heard["params"]["uri"], URI);
        heard["params"]["diagnostics"].as_array().unwrap().clone()
    }

    fn at(&mut self, method: &str, line: u32, character: u32) -> Value {
        let position = json!({"line": line, "character": character});
        self.ask(method, json!({"textDocument": {"uri": URI}, "position": position}))
    }

    fn close(mut self) {
        assert_eq!(self.ask("shutdown", Value::Null), Value::Null);
        self.tell("exit", Value::Null);
        assert_eq!(self.child.wait().unwrap().code(), Some(0));
    }
}

/// One message that was no JSON ended the server.
#[test]
fn a_message_that_cannot_be_read_is_refused_and_the_next_is_heard() {
    let scratch = Scratch::new("lsp-unreadable");
    let mut editor = Editor::open(&scratch);
    for (body, code) in [("{\"id\": 1,", -32700), ("{\"jsonrpc\": \"2.0\"}", -32600), ("", -32700)]
    {
        write!(editor.to, "Content-Length: {}\r\n\r\n{body}", body.len()).unwrap();
        editor.to.flush().unwrap();
        let heard = editor.hear();
        assert_eq!(
            (&heard["id"], &heard["error"]["code"]),
            (&Value::Null, &json!(code)),
            "{heard}"
        );
    }
    assert_eq!(editor.write(1, "look()\n"), [] as [Value; 0]);
    editor.close();
}

#[test]
fn a_session_from_a_mistake_to_a_tidy_file() {
    let scratch = Scratch::new("lsp-session");
    let mut editor = Editor::open(&scratch);
    // A degree sign before the mistake: columns count in UTF-16.
    let wrong = "task turn(o: Container) {\n    check tilt(o) <= 5 ° and hieght(o) <= 1 cm\n}\n";
    let found = editor.write(1, wrong);
    assert_eq!(found.len(), 1, "{found:?}");
    assert_eq!(found[0]["code"], "task::unknown_name");
    assert_eq!(found[0]["range"]["start"], json!({"line": 1, "character": 29}));
    assert!(found[0]["message"].as_str().unwrap().contains("did you mean `height`?"));

    let right = wrong.replace("hieght", "height") + "turn( jar )\n";
    assert_eq!(editor.write(2, &right), [] as [Value; 0]);
    let hover = editor.at("textDocument/hover", 1, 12);
    assert!(
        hover["contents"]["value"].as_str().unwrap().contains("tilt(o: Object) -> Angle"),
        "{hover}"
    );
    let hover = editor.at("textDocument/hover", 3, 7);
    assert!(hover["contents"]["value"].as_str().unwrap().contains("transparent jar"), "{hover}");
    // The call leads to its task, `o` to the parameter.
    let place = editor.at("textDocument/definition", 3, 2);
    assert_eq!(
        (&place["uri"], &place["range"]["start"]),
        (&json!(URI), &json!({"line": 0, "character": 5}))
    );
    let place = editor.at("textDocument/definition", 1, 15);
    assert_eq!(place["range"]["start"], json!({"line": 0, "character": 10}));
    // What fits inside the parenthesis: containers, and nothing else that has a name.
    let offers = editor.at("textDocument/completion", 3, 6);
    let labels: Vec<&str> =
        offers.as_array().unwrap().iter().map(|offer| offer["label"].as_str().unwrap()).collect();
    assert_eq!(labels, ["cup", "jar", "o:"]);
    let edits = editor.ask(
        "textDocument/formatting",
        json!({"textDocument": {"uri": URI}, "options": {"tabSize": 4, "insertSpaces": true}}),
    );
    assert!(edits[0]["newText"].as_str().unwrap().ends_with("turn(jar)\n"), "{edits}");
    editor.close();
}

/// Every fix that is offered, carried out, leaves a text without that mistake.
#[test]
fn a_fix_mends_what_it_is_offered_for() {
    let scratch = Scratch::new("lsp-fixes");
    let mut editor = Editor::open(&scratch);
    let task = |line: &str| format!("task mine(o: Container) {{\n    {line}\n}}\n");
    let mut version = 0;
    for (wrong, title, right) in [
        ("pick(jra)", "`jar` instead of `jra`", "pick(jar)"),
        ("check tilt(o) <= 5", "insert `deg`", "check tilt(o) <= 5 deg"),
        ("pour(jar, cup, amount = 30 mL)", "`:` instead of `=`", "pour(jar, cup, amount: 30 mL)"),
        ("pour(jar cup)", "insert `,`", "pour(jar , cup)"),
        ("pick(\"jar\")", "`jar` instead of `\"jar\"`", "pick(jar)"),
        ("pick(jar))", "remove `)`", "pick(jar)"),
    ] {
        version += 1;
        let text = task(wrong);
        let found = editor.write(version, &text);
        assert_eq!(found.len(), 1, "{wrong}: {found:?}");
        let fixes = editor.ask(
            "textDocument/codeAction",
            json!({"textDocument": {"uri": URI}, "range": found[0]["range"], "context": {"diagnostics": []}}),
        );
        assert_eq!(fixes[0]["title"], title, "{wrong}: {fixes}");
        let mended = edited(&text, &fixes[0]["edit"]["changes"][URI]);
        assert_eq!(mended, task(right));
        version += 1;
        assert_eq!(editor.write(version, &mended), [] as [Value; 0], "{mended}");
    }
    editor.close();
}

/// Returns a text with edits of one line each carried out; the columns of these texts are bytes.
fn edited(text: &str, edits: &Value) -> String {
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    let mut edits: Vec<&Value> = edits.as_array().unwrap().iter().collect();
    let at = |edit: &Value, end: &str, what: &str| {
        usize::try_from(edit["range"][end][what].as_u64().unwrap()).unwrap()
    };
    edits.sort_by_key(|edit| std::cmp::Reverse(at(edit, "start", "character")));
    for edit in edits {
        let columns = at(edit, "start", "character")..at(edit, "end", "character");
        lines[at(edit, "start", "line")].replace_range(columns, edit["newText"].as_str().unwrap());
    }
    lines.join("\n") + "\n"
}

#[test]
fn a_name_is_found_and_renamed_wherever_it_means_the_same() {
    let scratch = Scratch::new("lsp-names");
    let mut editor = Editor::open(&scratch);
    let text = "/// Put o away.\ntask tidy(o: Graspable, amount: Volume = 30 mL) {\n    pick(o)\n    \
                pour(jar, cup, amount: amount)\n    place(o)\n}\ntidy(jar, amount: 20 mL)\n";
    assert_eq!(editor.write(1, text), [] as [Value; 0]);
    let lines = |found: &Value| -> Vec<u64> {
        found
            .as_array()
            .unwrap()
            .iter()
            .map(|at| at["range"]["start"]["line"].as_u64().unwrap())
            .collect()
    };
    // `o` of the task: its parameter and two uses, not the `o` of the note.
    let position = json!({"line": 2, "character": 9});
    let asked = json!({"textDocument": {"uri": URI}, "position": position, "context": {"includeDeclaration": true}});
    assert_eq!(lines(&editor.ask("textDocument/references", asked)), [1, 2, 4]);
    // `amount` of `tidy` is not the `amount` of `pour` before the colon.
    let position = json!({"line": 3, "character": 29});
    let renamed = editor.ask(
        "textDocument/rename",
        json!({"textDocument": {"uri": URI}, "position": position, "newName": "how_much"}),
    );
    let after = edited(text, &renamed["changes"][URI]);
    assert!(after.contains("amount: how_much)"), "{after}");
    assert!(after.contains("tidy(jar, how_much: 20 mL)"), "{after}");
    assert_eq!(editor.write(2, &after), [] as [Value; 0]);
    // What the standard library defines is found here, and not renamed.
    let position = json!({"line": 2, "character": 5});
    let place = json!({"textDocument": {"uri": URI}, "position": position});
    assert_eq!(editor.ask("textDocument/prepareRename", place), Value::Null);
    let help = editor.at("textDocument/signatureHelp", 3, 15);
    let label = help["signatures"][0]["label"].as_str().unwrap();
    assert!(label.starts_with("pour(source: Container, target: Container"), "{help}");
    assert_eq!(help["activeParameter"], 1);
    let symbols = editor.ask("textDocument/documentSymbol", json!({"textDocument": {"uri": URI}}));
    assert_eq!((&symbols[0]["name"], symbols.as_array().unwrap().len()), (&json!("tidy"), 1));
    editor.close();
}

/// The extension for VS Code, before a stand-in for its interface, where there is a `node`.
#[test]
fn the_extension_speaks_with_the_server() {
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
    let ran = std::process::Command::new("node")
        .arg(root.join("examples/editor/try.js"))
        .arg(env!("CARGO_BIN_EXE_trueup"))
        .output();
    let Ok(ran) = ran else {
        crate::absent::skipped("there is no `node` here");
        return;
    };
    assert!(ran.status.success(), "{}", String::from_utf8_lossy(&ran.stderr));
}

/// What is embedded in the program can be gone to as a file: a copy in the user's cache.
#[test]
fn the_embedded_library_can_be_gone_to() {
    let scratch = Scratch::new("lsp-embedded");
    let mut editor = Editor::open(&scratch);
    editor.write(1, "pour(jar, cup)\n");
    let place = editor.at("textDocument/definition", 0, 1);
    let path = place["uri"].as_str().unwrap().strip_prefix("file://").unwrap().to_owned();
    assert!(path.ends_with("/tasks/std.task"), "{path}");
    let text = std::fs::read_to_string(&path).unwrap();
    assert_eq!(text, include_str!("../../stdlib/tasks/std.task"));
    let line = usize::try_from(place["range"]["start"]["line"].as_u64().unwrap()).unwrap();
    assert!(text.lines().nth(line).unwrap().starts_with("task pour("), "{place}");
    // A fluent is in another file of it; a copy that was written into is put right.
    std::fs::write(&path, "task pour() { }").unwrap();
    editor.at("textDocument/definition", 0, 1);
    assert_eq!(std::fs::read_to_string(&path).unwrap(), text);
    editor.write(2, "check upright(jar)\n");
    let place = editor.at("textDocument/definition", 0, 8);
    assert!(place["uri"].as_str().unwrap().ends_with("/fluents/std.task"), "{place}");
    editor.close();
}

#[test]
fn a_hover_over_a_task_tells_what_it_needs_and_gives() {
    let scratch = Scratch::new("lsp-hover");
    let mut editor = Editor::open(&scratch);
    editor.write(1, "pour(jar, cup)\n");
    let hover = editor.at("textDocument/hover", 0, 1);
    let said = hover["contents"]["value"].as_str().unwrap();
    for part in [
        "pour(source: Container",
        "Pour from one container",
        "needs  visible(source)",
        "gives  poured(target",
    ] {
        assert!(said.contains(part), "{part} in {said}");
    }
    // A request nobody answers is refused, and the session goes on.
    editor.id += 1;
    let id = editor.id;
    let method = "textDocument/foldingRange";
    editor.send(&json!({"jsonrpc": "2.0", "id": id, "method": method, "params": {}}));
    assert!(editor.hear()["error"]["message"].as_str().unwrap().contains("foldingRange"));
    assert!(!editor.at("textDocument/hover", 0, 6).is_null());
    editor.close();
}

/// Every prefix of a file, as it is being typed, with every question at its end.
#[test]
fn every_prefix_of_a_file_is_survived() {
    let (server, client) = Connection::memory();
    let serving =
        std::thread::spawn(move || serve(&server, &Stdlib::embedded(), Places::default()));
    let mut id = 0;
    let mut ask = |method: &str, params: Value| {
        id += 1;
        client.sender.send(Request::new(id.into(), method.into(), params).into()).unwrap();
        loop {
            if let Message::Response(response) = client.receiver.recv().unwrap() {
                return response.response_result.unwrap();
            }
        }
    };
    ask("initialize", json!({"capabilities": {}}));
    let tell = |method: &str, params: Value| {
        client.sender.send(Notification::new(method.into(), params).into()).unwrap();
    };
    tell("initialized", json!({}));
    let text = include_str!("../../stdlib/tasks/std.task");
    let start = text.find("/// Pick up one object").unwrap();
    let text = &text[start..];
    for (end, _) in text.char_indices().step_by(7) {
        let prefix = &text[..end];
        let document = json!({"uri": URI, "languageId": "task", "version": 1, "text": prefix});
        tell("textDocument/didOpen", json!({ "textDocument": document }));
        let line = prefix.matches('\n').count();
        let column = prefix.rsplit('\n').next().unwrap().encode_utf16().count();
        let at =
            json!({"textDocument": {"uri": URI}, "position": {"line": line, "character": column}});
        let all =
            ["completion", "hover", "definition", "signatureHelp", "prepareRename", "references"];
        for method in all {
            ask(&format!("textDocument/{method}"), at.clone());
        }
        let whole = json!({"textDocument": {"uri": URI}});
        ask("textDocument/documentSymbol", whole);
        ask(
            "textDocument/formatting",
            json!({"textDocument": {"uri": URI}, "options": {"tabSize": 4, "insertSpaces": true}}),
        );
        let end = json!({"start": at["position"], "end": at["position"]});
        ask("textDocument/codeAction", json!({"textDocument": {"uri": URI}, "range": end}));
    }
    ask("shutdown", Value::Null);
    tell("exit", Value::Null);
    serving.join().unwrap().unwrap();
}
