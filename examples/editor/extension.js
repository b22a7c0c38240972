// What VS Code asks while somebody writes a `.task` file, put to `trueup lsp`, and its answers put back.
//
// Plain JavaScript, no build step and nothing to install: `client.js` speaks with the server, this file knows VS Code.

"use strict";

const fs = require("node:fs");
const path = require("node:path");
const vscode = require("vscode");
const { Client } = require("./client.js");

const LANGUAGE = "task";
/** How long is waited after a key before the text is sent, ms. */
const PAUSE = 150;

let client = null;
let wrong = null;
const waiting = new Map();

/** Returns the program: as set, or as built in the checkout that this folder lies in, or as the shell finds it. */
function program() {
  const set = vscode.workspace.getConfiguration("trueup").get("path");
  if (set) return set;
  // A link to this folder leads back to the checkout.
  const root = path.join(fs.realpathSync(__dirname), "..", "..");
  const built = ["release", "debug"].map((kind) => path.join(root, "target", kind, "trueup"));
  return built.find((file) => fs.existsSync(file)) ?? "trueup";
}

const place = (position) => ({ line: position.line, character: position.character });
const span = (range) => ({ start: place(range.start), end: place(range.end) });
const range = (r) => new vscode.Range(r.start.line, r.start.character, r.end.line, r.end.character);
const isOurs = (document) => document.languageId === LANGUAGE;
const uriOf = (document) => document.uri.toString();

/** Asks about a place of a document, once the server has the text as it stands; nothing when it has no answer. */
async function at(method, document, position, more = {}) {
  flush(document);
  const params = { textDocument: { uri: uriOf(document) }, position: place(position), ...more };
  return client?.ask(method, params);
}

function open(document) {
  if (!client || !isOurs(document)) return;
  const textDocument = {
    uri: uriOf(document), languageId: LANGUAGE, version: document.version, text: document.getText(),
  };
  client.tell("textDocument/didOpen", { textDocument });
}

/** Sends a text that was changed a moment ago. */
function flush(document) {
  const uri = uriOf(document);
  const timer = waiting.get(uri);
  if (timer === undefined) return;
  clearTimeout(timer);
  waiting.delete(uri);
  client?.tell("textDocument/didChange", {
    textDocument: { uri, version: document.version },
    contentChanges: [{ text: document.getText() }],
  });
}

function changed({ document }) {
  if (!isOurs(document)) return;
  clearTimeout(waiting.get(uriOf(document)));
  waiting.set(uriOf(document), setTimeout(() => flush(document), PAUSE));
}

function closed(document) {
  if (!isOurs(document)) return;
  clearTimeout(waiting.get(uriOf(document)));
  waiting.delete(uriOf(document));
  client?.tell("textDocument/didClose", { textDocument: { uri: uriOf(document) } });
}

function diagnosed({ uri, diagnostics }) {
  const told = diagnostics.map((found) => {
    // The protocol counts kinds from 1, VS Code from 0.
    const one = new vscode.Diagnostic(range(found.range), found.message, found.severity - 1);
    one.code = found.code;
    one.source = found.source;
    one.relatedInformation = (found.relatedInformation ?? []).map((further) =>
      new vscode.DiagnosticRelatedInformation(location(further.location), further.message));
    return one;
  });
  wrong.set(vscode.Uri.parse(uri), told);
}

const location = (found) => new vscode.Location(vscode.Uri.parse(found.uri), range(found.range));

function edited(found) {
  const edit = new vscode.WorkspaceEdit();
  for (const [uri, changes] of Object.entries(found.changes)) {
    for (const change of changes) edit.replace(vscode.Uri.parse(uri), range(change.range), change.newText);
  }
  return edit;
}

const providers = {
  completion: {
    async provideCompletionItems(document, position) {
      const offers = (await at("textDocument/completion", document, position)) ?? [];
      return offers.map((offer) => {
        const item = new vscode.CompletionItem(offer.label, offer.kind - 1);
        item.detail = offer.detail;
        item.documentation = offer.documentation;
        item.insertText = offer.insertText;
        item.sortText = offer.sortText;
        return item;
      });
    },
  },
  hover: {
    async provideHover(document, position) {
      const found = await at("textDocument/hover", document, position);
      return found && new vscode.Hover(new vscode.MarkdownString(found.contents.value), range(found.range));
    },
  },
  signature: {
    async provideSignatureHelp(document, position) {
      const found = await at("textDocument/signatureHelp", document, position);
      if (!found) return undefined;
      const help = new vscode.SignatureHelp();
      help.signatures = found.signatures.map((told) => {
        const one = new vscode.SignatureInformation(told.label, told.documentation);
        one.parameters = told.parameters.map((param) => new vscode.ParameterInformation(param.label));
        return one;
      });
      help.activeSignature = 0;
      // Beyond the last one none is marked.
      help.activeParameter = found.activeParameter ?? found.signatures[0].parameters.length;
      return help;
    },
  },
  definition: {
    async provideDefinition(document, position) {
      const found = await at("textDocument/definition", document, position);
      return found && location(found);
    },
  },
  references: {
    async provideReferences(document, position, context) {
      const found = await at("textDocument/references", document, position, { context });
      return (found ?? []).map(location);
    },
  },
  rename: {
    async prepareRename(document, position) {
      const found = await at("textDocument/prepareRename", document, position);
      if (!found) throw new Error("This name is not defined in a text that is open.");
      return { range: range(found.range), placeholder: found.placeholder };
    },
    async provideRenameEdits(document, position, newName) {
      return edited(await at("textDocument/rename", document, position, { newName }));
    },
  },
  symbols: {
    async provideDocumentSymbols(document) {
      flush(document);
      const params = { textDocument: { uri: uriOf(document) } };
      const symbol = (found) => {
        const one = new vscode.DocumentSymbol(
          found.name, "", found.kind - 1, range(found.range), range(found.selectionRange));
        one.children = found.children.map(symbol);
        return one;
      };
      return ((await client?.ask("textDocument/documentSymbol", params)) ?? []).map(symbol);
    },
  },
  fixes: {
    async provideCodeActions(document, wanted, context) {
      flush(document);
      const params = {
        textDocument: { uri: uriOf(document) }, range: span(wanted), context: { diagnostics: [] },
      };
      const found = (await client?.ask("textDocument/codeAction", params)) ?? [];
      return found.map((told) => {
        const action = new vscode.CodeAction(told.title, vscode.CodeActionKind.QuickFix);
        action.edit = edited(told.edit);
        action.isPreferred = told.isPreferred;
        const mended = told.diagnostics[0];
        action.diagnostics = (context.diagnostics ?? []).filter((one) => one.message === mended.message);
        return action;
      });
    },
  },
  layout: {
    async provideDocumentFormattingEdits(document) {
      flush(document);
      const params = { textDocument: { uri: uriOf(document) }, options: { tabSize: 2, insertSpaces: true } };
      const edits = (await client?.ask("textDocument/formatting", params)) ?? [];
      return edits.map((edit) => new vscode.TextEdit(range(edit.range), edit.newText));
    },
  },
};

async function start() {
  const stdlib = vscode.workspace.getConfiguration("trueup").get("stdlib");
  const heard = (method, params) => method === "textDocument/publishDiagnostics" && diagnosed(params);
  let isWanted = true;
  const ended = (words) => {
    if (isWanted && client === mine) {
      vscode.window.showErrorMessage(`trueup: ${words}. Is the program built? \`trueup.path\` names it.`);
    }
  };
  const mine = new Client(program(), [...(stdlib ? ["--stdlib", stdlib] : []), "lsp"], heard, ended);
  mine.leave = () => {
    isWanted = false;
    return mine.end();
  };
  client = mine;
  await mine.begin();
  vscode.workspace.textDocuments.forEach(open);
}

async function restart() {
  await client?.leave();
  wrong.clear();
  await start();
}

async function activate(context) {
  const { languages, workspace, commands } = vscode;
  wrong = languages.createDiagnosticCollection("trueup");
  context.subscriptions.push(
    wrong,
    workspace.onDidOpenTextDocument(open),
    workspace.onDidChangeTextDocument(changed),
    workspace.onDidCloseTextDocument(closed),
    commands.registerCommand("trueup.restart", restart),
    languages.registerCompletionItemProvider(LANGUAGE, providers.completion, "(", ",", ":", " "),
    languages.registerHoverProvider(LANGUAGE, providers.hover),
    languages.registerSignatureHelpProvider(LANGUAGE, providers.signature, "(", ","),
    languages.registerDefinitionProvider(LANGUAGE, providers.definition),
    languages.registerReferenceProvider(LANGUAGE, providers.references),
    languages.registerRenameProvider(LANGUAGE, providers.rename),
    languages.registerDocumentSymbolProvider(LANGUAGE, providers.symbols),
    languages.registerCodeActionsProvider(LANGUAGE, providers.fixes),
    languages.registerDocumentFormattingEditProvider(LANGUAGE, providers.layout),
  );
  await start().catch(() => null);
}

function deactivate() {
  return client?.leave();
}

module.exports = { activate, deactivate };
