// The bundled extension: it starts its server, says why where it cannot, and its commands do what they say.
"use strict";

const assert = require("node:assert/strict");
const { spawnSync } = require("node:child_process");
const fs = require("node:fs");
const os = require("node:os");
const path = require("node:path");
const { afterEach, beforeEach, describe, it, mock } = require("node:test");
const { FOLDER } = require("./scopes");
const { extensionIn, fakeVscode } = require("./fake-vscode");

const ROOT = process.env.MISSIONC_ROOT ?? path.join(FOLDER, "..", "..");
const PYTHON = process.env.PYTHON ?? "python3";
const BUNDLE = path.join(FOLDER, "dist", "extension.js");
const STUB = path.join(__dirname, "server-stub.js");

describe("the extension", () => {
  let folder, notes, extension, servers;

  beforeEach(() => {
    // The client gives a server two seconds to end. Here nobody's time runs out, however slow the machine is.
    mock.timers.enable({ apis: ["setTimeout"] });
    servers = [];
    folder = fs.mkdtempSync(path.join(os.tmpdir(), "mission-"));
    notes = path.join(folder, "notes");
    process.env.STUB_NOTES = notes;
  });

  afterEach(async () => {
    await ended();
    mock.timers.reset();
    delete process.env.STUB_FAILS;
    fs.rmSync(folder, { recursive: true });
  });

  async function activated(options) {
    const found = fakeVscode(options);
    extension = extensionIn(found.fake, BUNDLE, (server) => servers.push(server));
    await extension.activate({ subscriptions: [] });
    return found;
  }

  const noted = () => fs.readFileSync(notes, "utf8").trim().split("\n");

  /** The extension is put away, and the servers it started have ended. */
  async function ended() {
    await extension?.deactivate();
    await Promise.all(servers);
  }

  function open(found, name, text, { saved = true } = {}) {
    const file = path.join(folder, name);
    fs.writeFileSync(file, text);
    const document = { languageId: "mission", uri: found.uri(file), getText: () => text, save: async () => saved };
    Object.assign(document, { version: 1, positionAt: (offset) => offset, offsetAt: (position) => position });
    found.fake.window.activeTextEditor = { document };
    found.fake.workspace.textDocuments.push(document);
    return file;
  }

  it("starts `missionc lsp` over standard input and output, and shakes hands", async () => {
    const { done } = await activated({ path: STUB });
    await ended();
    assert.ok(noted().includes("lsp"));
    assert.ok(noted().includes("initialized"));
    assert.deepEqual(done.errors, []);
    assert.deepEqual([...done.commands.keys()].sort(), contributed());
  });

  it("shakes hands with missionc itself", { skip: noServer() }, async () => {
    const program = path.join(folder, "missionc");
    fs.writeFileSync(program, `#!/bin/sh\ncd "${ROOT}" && exec "${PYTHON}" -m missionc "$@"\n`, { mode: 0o755 });
    const { done } = await activated({ path: program });
    assert.deepEqual(done.errors, [], done.log.join("\n"));
  });

  it("ends the server when it is deactivated", async () => {
    await activated({ path: STUB });
    await ended();
    assert.ok(noted().includes("exit"));
  });

  it("starts the server anew on command, and when its path changes", async () => {
    const { done } = await activated({ path: STUB });
    await done.commands.get("missionc.restart")();
    assert.equal(noted().filter((line) => line === "lsp").length, 2);
    for (const listener of done.changed) await listener({ affectsConfiguration: (name) => name === "missionc.path" });
    assert.equal(noted().filter((line) => line === "lsp").length, 3);
  });

  it("says once how to install a missionc that is not there, and copies the command", async () => {
    const { done } = await activated({ path: path.join(folder, "nowhere"), answer: "Copy the command" });
    assert.equal(done.errors.length, 1);
    assert.match(done.errors[0], /nowhere lsp` did not start.*pip install 'missionc\[lsp\]'.*missionc\.path/);
    assert.deepEqual(done.copied, ["pip install 'missionc[lsp]'"]);
  });

  it("says once that a server ended before it answered, and keeps what it said", async () => {
    process.env.STUB_FAILS = "pygls is not installed";
    const { done } = await activated({ path: STUB });
    assert.equal(done.errors.length, 1);
    assert.match(done.errors[0], /did not start.*pip install 'missionc\[lsp\]'/);
    assert.ok(done.log.some((line) => line.includes("pygls is not installed")), done.log.join("\n"));
  });

  it("compiles the mission in a terminal, whatever its file is called", async () => {
    const found = await activated({ path: STUB });
    const file = open(found, "a $(touch owned) 'b'.mission", "mission relay");
    await found.done.commands.get("missionc.compile")();
    const [{ execution, name }] = found.done.tasks;
    assert.deepEqual([execution.program, ...execution.words], [STUB, "compile", file, "--force"]);
    assert.equal(execution.options.cwd, folder);
    assert.equal(name, "compile a $(touch owned) 'b'.mission");
  });

  it("compiles nothing where no mission is open, or it could not be saved", async () => {
    const found = await activated({ path: STUB });
    await found.done.commands.get("missionc.compile")();
    assert.match(found.done.warnings[0], /Open a mission first/);
    open(found, "relay.mission", "mission relay", { saved: false });
    await found.done.commands.get("missionc.compile")();
    assert.deepEqual(found.done.tasks, []);
  });

  it("shows the report of the mission, which lies under its name", async () => {
    const found = await activated({ path: STUB });
    open(found, "other.mission", "# mission no\nmission relay\n");
    const report = path.join(folder, "build", "relay", "report.html");
    fs.mkdirSync(path.dirname(report), { recursive: true });
    fs.writeFileSync(report, "<p>first");
    const showReport = found.done.commands.get("missionc.showReport");
    await showReport();
    const [panel] = found.done.panels;
    assert.equal(panel.title, "relay: report");
    assert.equal(panel.webview.html, "<p>first");
    assert.deepEqual([panel.options.enableScripts, panel.options.localResourceRoots], [true, []]);

    fs.writeFileSync(report, "<p>second");
    found.done.ended.forEach((listener) => listener({ execution: { task: { source: "of another" } } }));
    assert.equal(panel.webview.html, "<p>first");
    found.done.ended.forEach((listener) => listener({ execution: { task: { source: "missionc" } } }));
    assert.equal(panel.webview.html, "<p>second");

    await showReport();
    assert.deepEqual([found.done.panels.length, panel.revealed], [1, 2]);
    panel.dispose();
    await showReport();
    assert.equal(found.done.panels.length, 2);
  });

  it("compiles the mission that a lens above the text names", async () => {
    const found = await activated({ path: STUB });
    const file = open(found, "one.mission", "mission one");
    open(found, "two.mission", "mission two");
    await found.done.commands.get("missionc.compile")(`file://${file}`);
    assert.equal(found.done.tasks[0].name, "compile one.mission");
    assert.ok(noted().includes('{"commands":["missionc.compile","missionc.showReport","missionc.showMap"]}'));
  });

  it("draws the map of the mission as it is typed, and writes a drag into it", async () => {
    const found = await activated({ path: STUB });
    const file = open(found, "relay.mission", "mission relay");
    const { document } = found.fake.window.activeTextEditor;
    await found.done.commands.get("missionc.showMap")();
    const [{ webview, options }] = found.done.panels;
    const named = `file://${file}`;
    assert.deepEqual(webview.posted, [{ version: 1, whole: true, scene: { things: [] }, name: named }]);
    assert.ok(noted().includes(`scene ${named}`));
    assert.deepEqual(options.localResourceRoots.map(({ fsPath }) => fsPath), [path.dirname(BUNDLE)]);
    const files = [...webview.html.matchAll(/(?:src|href)="vscode-resource:([^"]+)"/g)].map((match) => match[1]);
    assert.deepEqual(files.map((each) => path.basename(each)), ["map.css", "map.js"]);
    assert.ok(files.every((each) => fs.existsSync(each)));
    assert.match(webview.html, /default-src 'none'; script-src vscode-resource:; style-src vscode-resource:"/);

    const [typed] = found.done.typed;
    await typed({ document });
    await typed({ document: {} });
    assert.equal(webview.posted.length, 2);

    await webview.told({ edits: [{ from: 3, to: 5, insert: "2.5" }], version: 1 });
    assert.deepEqual(found.done.edited, [[[3, 5, "2.5"]]]);
    document.version = 2;
    await webview.told({ edits: [{ from: 3, to: 5, insert: "2.5" }], version: 1 });
    assert.deepEqual([found.done.edited.length, webview.posted.length], [1, 2]);
  });

  it("offers to compile a mission that has no report yet", async () => {
    const found = await activated({ path: STUB, answer: "Compile this mission" });
    open(found, "relay.mission", "mission relay");
    await found.done.commands.get("missionc.showReport")();
    assert.match(found.done.warnings[0], /No report at .*report\.html/);
    assert.equal(found.done.tasks.length, 1);
  });
});

/** Why the language server itself cannot be asked; false where it can. */
function noServer() {
  const asked = spawnSync(PYTHON, ["-m", "missionc", "lsp"], { cwd: ROOT, input: "", encoding: "utf8", timeout: 60_000 });
  return asked.status === 0 ? false : `missionc lsp: ${asked.stderr.trim().split("\n").pop()}`;
}

function contributed() {
  const { contributes } = JSON.parse(fs.readFileSync(path.join(FOLDER, "package.json"), "utf8"));
  return contributes.commands.map(({ command }) => command).sort();
}
