// The extension without VS Code: a stand-in for its interface, the real language server, one short session.
//
//   node examples/editor/try.js target/debug/trueup
//
// It ends with code 0 when every answer arrived as VS Code would have shown it.

"use strict";

const assert = require("node:assert");
const Module = require("node:module");

class Position { constructor(line, character) { Object.assign(this, { line, character }); } }
class Range {
  constructor(a, b, c, d) { this.start = new Position(a, b); this.end = new Position(c, d); }
}
/** A class of VS Code that only holds what it was given, under these names. */
const holder = (...names) => class {
  constructor(...values) { names.forEach((name, i) => (this[name] = values[i])); }
};
class WorkspaceEdit {
  constructor() { this.all = []; }
  replace(uri, range, text) { this.all.push({ uri: uri.toString(), range, text }); }
}
const uri = (text) => ({ toString: () => text });

const told = new Map();
const providers = {};
const register = (name) => (_, provider) => ((providers[name] = provider), { dispose() {} });
const nothing = () => ({ dispose() {} });
const listeners = {};
const listen = (name) => (call) => ((listeners[name] = call), { dispose() {} });
const documents = [];

const vscode = {
  Position, Range, WorkspaceEdit,
  Uri: { parse: uri },
  Location: holder("uri", "range"),
  Diagnostic: holder("range", "message", "severity"),
  DiagnosticRelatedInformation: holder("location", "message"),
  CompletionItem: holder("label", "kind"),
  Hover: holder("contents", "range"),
  MarkdownString: holder("value"),
  SignatureHelp: holder(),
  SignatureInformation: holder("label", "documentation"),
  ParameterInformation: holder("label"),
  DocumentSymbol: holder("name", "detail", "kind", "range", "selectionRange"),
  CodeAction: holder("title", "kind"),
  CodeActionKind: { QuickFix: "quickfix" },
  TextEdit: holder("range", "newText"),
  window: { showErrorMessage: (words) => { throw new Error(words); } },
  commands: { registerCommand: nothing },
  workspace: {
    textDocuments: documents,
    getConfiguration: () => ({ get: (name) => (name === "path" ? process.argv[2] : "") }),
    onDidOpenTextDocument: listen("open"),
    onDidChangeTextDocument: listen("change"),
    onDidCloseTextDocument: listen("close"),
  },
  languages: {
    createDiagnosticCollection: () => ({
      set: (at, found) => told.set(at.toString(), found), clear: () => told.clear(), dispose() {},
    }),
    registerCompletionItemProvider: register("completion"),
    registerHoverProvider: register("hover"),
    registerSignatureHelpProvider: register("signature"),
    registerDefinitionProvider: register("definition"),
    registerReferenceProvider: register("references"),
    registerRenameProvider: register("rename"),
    registerDocumentSymbolProvider: register("symbols"),
    registerCodeActionsProvider: register("fixes"),
    registerDocumentFormattingEditProvider: register("layout"),
  },
};

const load = Module._load;
Module._load = (name, ...rest) => (name === "vscode" ? vscode : load(name, ...rest));
const extension = require("./extension.js");

const document = (text) => ({
  languageId: "task", version: 1, uri: uri("file:///scratch/mine.task"), text, getText() { return this.text; },
});

/** Waits until something is so. */
async function until(holds, what) {
  for (let i = 0; i < 200; i++) {
    if (holds()) return;
    await new Promise((done) => setTimeout(done, 50));
  }
  assert.fail(what);
}

async function main() {
  const text = "task tidy(o: Graspable) {\n  pick(o)\n  place(o)\n}\ntidy(jra)\n";
  const own = document(text);
  documents.push(own);
  await extension.activate({ subscriptions: [] });
  const name = own.uri.toString();
  await until(() => told.get(name)?.length === 1, "one mistake is told");
  const [mistake] = told.get(name);
  assert.match(mistake.message, /jra/);
  assert.equal(mistake.severity, 0);

  const fixes = await providers.fixes.provideCodeActions(own, mistake.range, { diagnostics: [mistake] });
  assert.deepEqual(fixes.map((fix) => fix.title), ["`jar` instead of `jra`"]);
  assert.equal(fixes[0].edit.all[0].text, "jar");
  assert.deepEqual(fixes[0].diagnostics, [mistake]);

  own.text = text.replace("jra", "jar");
  own.version = 2;
  listeners.change({ document: own });
  const help = await providers.signature.provideSignatureHelp(own, new Position(4, 5));
  assert.equal(help.signatures[0].label, "tidy(o: Graspable)");
  assert.equal(help.activeParameter, 0);
  await until(() => told.get(name)?.length === 0, "the mistake is gone");

  const uses = await providers.references.provideReferences(own, new Position(1, 7), { includeDeclaration: true });
  assert.deepEqual(uses.map((use) => use.range.start.line), [0, 1, 2]);
  const renamed = await providers.rename.provideRenameEdits(own, new Position(4, 1), "tidy_up");
  assert.deepEqual(renamed.all.map((edit) => edit.range.start.line), [0, 4]);
  await assert.rejects(providers.rename.provideRenameEdits(own, new Position(1, 3), "grab"), /which is not open/);
  const [symbol] = await providers.symbols.provideDocumentSymbols(own);
  assert.equal(symbol.name, "tidy");
  const hover = await providers.hover.provideHover(own, new Position(1, 3));
  assert.match(hover.contents.value, /pick\(o: Graspable/);
  const offers = await providers.completion.provideCompletionItems(own, new Position(4, 5));
  assert.ok(offers.some((offer) => offer.label === "jar"));
  own.text = own.text.replace("  pick(o)", "pick( o )");
  own.version = 3;
  listeners.change({ document: own });
  const [laid] = await providers.layout.provideDocumentFormattingEdits(own);
  assert.match(laid.newText, /\n {4}pick\(o\)\n/);
  await extension.deactivate();
  console.log("the extension answers as it should");
}

main().catch((error) => {
  console.error(error);
  process.exit(1);
});
