// The language server's other end: one process, JSON-RPC over its stdin and stdout, answers to questions.
//
// Nothing here knows an editor. It takes the place of vscode-languageclient, which would have to be installed with npm: what
// is needed of it are these lines.

"use strict";

const { spawn } = require("node:child_process");

/** Longest answer that is read, bytes. */
const LONGEST = 64 * 1024 * 1024;

class Client {
  /** Starts the server. `heard(method, params)` is told what it says unasked, `ended(words)` that it is gone. */
  constructor(command, args, heard, ended) {
    this.heard = heard;
    this.asked = new Map();
    this.id = 0;
    this.rest = Buffer.alloc(0);
    this.isOver = false;
    this.child = spawn(command, args, { stdio: ["pipe", "pipe", "pipe"] });
    let last = "";
    this.child.stderr.on("data", (text) => (last = String(text).trim() || last));
    this.child.stdout.on("data", (bytes) => this.read(bytes));
    // A pipe that breaks is told by the end of the process.
    this.child.stdin.on("error", () => {});
    const over = (words) => {
      if (this.isOver) return;
      this.isOver = true;
      for (const { failed } of this.asked.values()) failed(new Error(words));
      this.asked.clear();
      ended(words);
    };
    this.child.on("error", (error) => over(`${command}: ${error.message}`));
    this.child.on("exit", (code) => over(`${command} ended with code ${code}${last && `: ${last}`}`));
  }

  /** Asks, and returns a promise of the answer. */
  ask(method, params) {
    if (this.isOver) return Promise.reject(new Error("the language server is not running"));
    const id = ++this.id;
    this.send({ jsonrpc: "2.0", id, method, params });
    return new Promise((answered, failed) => this.asked.set(id, { answered, failed }));
  }

  /** Tells, without an answer. */
  tell(method, params) {
    if (!this.isOver) this.send({ jsonrpc: "2.0", method, params });
  }

  /** Says who asks, and returns what the server can do. */
  async begin() {
    const params = { processId: process.pid, rootUri: null, capabilities: {} };
    const { capabilities } = await this.ask("initialize", params);
    this.tell("initialized", {});
    return capabilities;
  }

  /** Says goodbye, and waits until the server is gone; it is killed if it stays. */
  async end() {
    if (this.isOver) return;
    const gone = new Promise((done) => this.child.once("exit", done));
    const killed = setTimeout(() => this.child.kill(), 2000);
    await this.ask("shutdown", null).catch(() => null);
    this.tell("exit", null);
    await gone;
    clearTimeout(killed);
  }

  send(message) {
    const body = Buffer.from(JSON.stringify(message));
    this.child.stdin.write(`Content-Length: ${body.length}\r\n\r\n`);
    this.child.stdin.write(body);
  }

  read(bytes) {
    this.rest = Buffer.concat([this.rest, bytes]);
    for (;;) {
      const head = this.rest.indexOf("\r\n\r\n");
      if (head < 0) return;
      const length = /content-length: *(\d+)/i.exec(this.rest.toString("latin1", 0, head));
      if (!length || Number(length[1]) > LONGEST) return void this.child.kill();
      const end = head + 4 + Number(length[1]);
      if (this.rest.length < end) return;
      const message = JSON.parse(this.rest.toString("utf8", head + 4, end));
      this.rest = this.rest.subarray(end);
      this.take(message);
    }
  }

  take(message) {
    const asked = message.method === undefined && this.asked.get(message.id);
    if (asked) {
      this.asked.delete(message.id);
      if (message.error) asked.failed(new Error(message.error.message));
      else asked.answered(message.result);
    } else if (message.method !== undefined && message.id === undefined) {
      this.heard(message.method, message.params);
    }
  }
}

module.exports = { Client };
