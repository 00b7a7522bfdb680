#!/usr/bin/env node
// `missionc lsp` for the tests: it answers the handshake, and writes down what it was asked.
"use strict";

const fs = require("node:fs");
const rpc = require("vscode-jsonrpc/node");

const note = (line) => fs.appendFileSync(process.env.STUB_NOTES, `${line}\n`);
note(process.argv.slice(2).join(" "));
if (process.env.STUB_FAILS) {
  process.stderr.write(process.env.STUB_FAILS);
  process.exit(1);
}

const connection = rpc.createMessageConnection(process.stdin, process.stdout);
connection.onRequest("initialize", ({ initializationOptions }) => (note(JSON.stringify(initializationOptions)), { capabilities: {} }));
connection.onRequest("missionc/scene", ({ textDocument }) => (note(`scene ${textDocument.uri}`), { version: 1, whole: true, scene: { things: [] } }));
connection.onRequest("shutdown", () => null);
connection.onNotification((method) => note(method));
connection.onNotification("exit", () => {
  note("exit");
  process.exit(0);
});
connection.listen();
