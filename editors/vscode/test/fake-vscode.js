// As much of VS Code as the extension and its language client touch, so that both run here as they are shipped.
// What a test asks about is written out; whatever else is called, constructed or read gives something like it.
"use strict";

const childProcess = require("node:child_process");
const Module = require("node:module");

/** A thing that may be called, constructed, read and disposed of. */
function anything() {
  const own = new Map();
  const thing = new Proxy(class {}, {
    construct: (target, words, made) => (made === thing ? anything() : Reflect.construct(target, words, made)),
    get: (target, key) => {
      if (key === "prototype") return target.prototype;
      if (key === "then" || typeof key === "symbol") return undefined;
      if (!own.has(key)) own.set(key, anything());
      return own.get(key);
    },
    set: (_, key, value) => own.set(key, value) && true,
    apply: () => anything(),
  });
  return thing;
}

/** What a panel shows; `posted` was sent to its page, and `told` is what the page sends. */
function webview() {
  const made = { html: "", posted: [], cspSource: "vscode-resource:", asWebviewUri: ({ fsPath }) => `vscode-resource:${fsPath}` };
  made.postMessage = async (message) => made.posted.push(message);
  made.onDidReceiveMessage = (listener) => (made.told = listener);
  return made;
}

/** A fake, and what was done to it. */
function fakeVscode({ path, answer }) {
  const done = { commands: new Map(), errors: [], warnings: [], log: [], copied: [], opened: [], tasks: [], changed: [], ended: [], panels: [], typed: [], edited: [] };
  const fake = anything();
  const log = (...words) => done.log.push(words.join(" "));
  const uri = (file) => ({ fsPath: file, scheme: "file", toString: () => `file://${file}` });

  fake.version = "1.140.0";
  fake.env = { language: "en", appName: "test", clipboard: { writeText: async (text) => done.copied.push(text) } };
  fake.Uri = { file: uri, parse: (text) => uri(text.replace(/^file:\/\//, "")) };
  fake.commands = {
    registerCommand: (name, run) => (done.commands.set(name, run), { dispose: () => done.commands.delete(name) }),
    executeCommand: async (...words) => done.opened.push(words.join(" ")),
  };
  fake.window.createOutputChannel = () =>
    Object.assign(anything(), { error: log, warn: log, info: log, append: log, appendLine: log });
  fake.window.showErrorMessage = async (text) => (done.errors.push(text), answer);
  fake.window.showWarningMessage = async (text) => (done.warnings.push(text), answer);
  fake.window.activeTextEditor = undefined;
  fake.window.visibleTextEditors = [];
  fake.window.tabGroups = { all: [], onDidChangeTabs: () => anything(), onDidChangeTabGroups: () => anything() };
  fake.workspace.getConfiguration = () => ({ get: (key, initial) => (key === "path" ? path : initial) });
  fake.workspace.onDidChangeConfiguration = (listener) => (done.changed.push(listener), anything());
  fake.workspace.getWorkspaceFolder = () => undefined;
  fake.workspace.workspaceFolders = undefined;
  fake.workspace.textDocuments = [];
  fake.workspace.notebookDocuments = [];
  fake.workspace.onDidChangeTextDocument = (listener) => (done.typed.push(listener), anything());
  fake.workspace.openTextDocument = async (named) => fake.workspace.textDocuments.find(({ uri }) => `${uri}` === `${named}`);
  fake.workspace.applyEdit = async (edit) => (done.edited.push(edit.replaced), true);
  fake.WorkspaceEdit = class {
    replaced = [];
    replace = (_, range, text) => this.replaced.push([range.start, range.end, text]);
  };
  fake.Range = class {
    constructor(start, end) {
      Object.assign(this, { start, end });
    }
  };
  fake.ProcessExecution = function (program, words, options) {
    Object.assign(this, { program, words, options });
  };
  fake.Task = function (_, scope, name, source, execution) {
    Object.assign(this, { scope, name, source, execution });
  };
  fake.tasks = {
    executeTask: async (task) => done.tasks.push(task),
    onDidEndTaskProcess: (listener) => (done.ended.push(listener), anything()),
  };
  fake.window.createWebviewPanel = (kind, title, where, options) => {
    const panel = { kind, title, options, webview: webview(), revealed: 0, reveal: () => panel.revealed++ };
    panel.dispose = () => {};
    panel.onDidDispose = (listener) => (panel.dispose = listener);
    done.panels.push(panel);
    return panel;
  };
  return { fake, done, uri };
}

/**
 * The extension as it is shipped, with this in the place of VS Code.
 *
 * @param {(ended: Promise<unknown>) => void} started hears of each process that it starts, and when that has ended.
 */
function extensionIn(fake, file, started) {
  const load = Module._load;
  const spawn = (...words) => {
    const child = childProcess.spawn(...words);
    started(new Promise((ended) => child.on("error", ended).on("close", ended)));
    return child;
  };
  const instead = { vscode: fake, child_process: { ...childProcess, spawn } };
  Module._load = (name, ...rest) => instead[name.replace(/^node:/, "")] ?? load(name, ...rest);
  try {
    delete require.cache[require.resolve(file)];
    return require(file);
  } finally {
    Module._load = load;
  }
}

module.exports = { fakeVscode, extensionIn };
