// The extension: the language server's client, and its commands.
"use strict";

const fs = require("node:fs");
const os = require("node:os");
const path = require("node:path");
const vscode = require("vscode");
const { CloseAction, LanguageClient } = require("vscode-languageclient/node");
const { MapPreview } = require("./map_preview");
const { INSTALL, compileArguments, lensCommands, missionName, programPath, serverArguments, whyNot } = require("./missionc");

/** @type {LanguageClient | undefined} */
let client;
/** @type {vscode.LogOutputChannel} */
let output;
/** What shows a report, by the report's path. @type {Map<string, vscode.WebviewPanel>} */
const panels = new Map();
/** @type {InstanceType<typeof MapPreview>} */
let map;
/** Tells the server of each new plan, for what it says of them above the text. @type {vscode.FileSystemWatcher | undefined} */
let plans;

/** @param {vscode.ExtensionContext} context */
async function activate(context) {
  output = vscode.window.createOutputChannel("missionc", { log: true });
  map = new MapPreview(async (document) => (await client?.sendRequest("missionc/scene", { textDocument: { uri: document.uri.toString() } })) ?? null);
  context.subscriptions.push(
    output,
    map,
    vscode.commands.registerCommand("missionc.restart", restart),
    vscode.commands.registerCommand("missionc.compile", compile),
    vscode.commands.registerCommand("missionc.showReport", showReport),
    vscode.commands.registerCommand("missionc.showMap", showMap),
    vscode.workspace.onDidGrantWorkspaceTrust(restart),
    vscode.workspace.onDidChangeConfiguration((change) => {
      if (change.affectsConfiguration("missionc.path")) return restart();
    }),
    vscode.tasks.onDidEndTaskProcess((end) => {
      if (end.execution.task.source === "missionc") for (const [report, panel] of panels) show(report, panel);
    }),
  );
  await start();
}

async function deactivate() {
  const stopped = client;
  client = undefined;
  await stopped?.stop();
}

/** A client that leaves what went wrong before the first answer to whoever started it. */
class Client extends LanguageClient {
  answered = false;

  /** @type {LanguageClient["error"]} */
  error(message, data, notify) {
    super.error(message, data, this.answered && notify);
  }
}

async function start() {
  const program = programOf();
  plans?.dispose();
  plans = vscode.workspace.createFileSystemWatcher("**/build/*/plan.json");
  /** @type {Client} */
  const starting = new Client(
    "missionc",
    "missionc",
    { command: program, args: serverArguments() },
    {
      documentSelector: [{ language: "mission" }],
      outputChannel: output,
      initializationOptions: { commands: lensCommands(vscode.workspace.isTrusted) },
      synchronize: { fileEvents: plans },
      initializationFailedHandler: () => false,
      errorHandler: {
        error: (error, message, count) => usually.error(error, message, count),
        // A server that ends before it answered would end again.
        closed: () => (starting.answered ? usually.closed() : { action: CloseAction.DoNotRestart, handled: true }),
      },
    },
  );
  const usually = starting.createDefaultErrorHandler();
  try {
    await starting.start();
    starting.answered = true;
    client = starting;
    await map.refresh();
  } catch (error) {
    await tellWhyNot(program, error);
  }
}

async function restart() {
  await deactivate();
  await start();
}

/** @param {string} program @param {unknown} error */
async function tellWhyNot(program, error) {
  const [copy, settings, log] = ["Copy the command", "Open settings", "Show output"];
  output.error(String(error));
  const chosen = await vscode.window.showErrorMessage(whyNot(program), copy, settings, log);
  if (chosen === copy) await vscode.env.clipboard.writeText(INSTALL);
  if (chosen === settings) await vscode.commands.executeCommand("workbench.action.openSettings", "missionc.path");
  if (chosen === log) output.show();
}

/** Runs in a terminal, without a shell between: no character of a file's name means anything there. @param {unknown} [uri] */
async function compile(uri) {
  const document = await savedMission(uri);
  if (!document) return;
  const cwd = folderOf(document.uri);
  const execution = new vscode.ProcessExecution(programOf(document.uri), compileArguments(document.uri.fsPath), { cwd });
  const task = new vscode.Task(
    { type: "process" },
    vscode.workspace.getWorkspaceFolder(document.uri) ?? vscode.TaskScope.Workspace,
    `compile ${path.basename(document.uri.fsPath)}`,
    "missionc",
    execution,
  );
  await vscode.tasks.executeTask(task);
}

/** Beside the text: so it can be seen too where the files lie on another machine. @param {unknown} [uri] */
async function showReport(uri) {
  const document = await savedMission(uri);
  if (!document) return;
  const name = missionName(document.getText());
  if (!name) {
    await vscode.window.showWarningMessage("The file has no `mission NAME`, which names the report.");
    return;
  }
  const report = path.join(folderOf(document.uri), "build", name, "report.html");
  if (fs.existsSync(report)) {
    const panel = panels.get(report) ?? panelFor(report, name);
    show(report, panel);
    panel.reveal();
    return;
  }
  const compileNow = "Compile this mission";
  const chosen = await vscode.window.showWarningMessage(`No report at ${report}.`, compileNow);
  if (chosen === compileNow) await compile(uri);
}

/** @param {unknown} [uri] */
async function showMap(uri) {
  const document = await mission(uri);
  if (!document) return;
  await map.show(document);
  map.reveal();
}

/** @param {string} report @param {string} name */
function panelFor(report, name) {
  const panel = vscode.window.createWebviewPanel("missionc.report", `${name}: report`, vscode.ViewColumn.Beside, {
    enableScripts: true,
    localResourceRoots: [],
    retainContextWhenHidden: true,
  });
  panels.set(report, panel);
  panel.onDidDispose(() => panels.delete(report));
  return panel;
}

/** The report as it is now; the one before where there is none. @param {string} report @param {vscode.WebviewPanel} panel */
function show(report, panel) {
  if (fs.existsSync(report)) panel.webview.html = fs.readFileSync(report, "utf8");
}

/** The mission that a code lens names, or that in the active editor; asks for one where there is none. @param {unknown} [uri] */
async function mission(uri) {
  const document =
    typeof uri === "string" ? await vscode.workspace.openTextDocument(vscode.Uri.parse(uri)) : vscode.window.activeTextEditor?.document;
  if (document?.languageId === "mission") return document;
  await vscode.window.showWarningMessage("Open a mission first (a file that ends in .mission).");
  return undefined;
}

/** The same, as it is on disk. @param {unknown} [uri] */
async function savedMission(uri) {
  const document = await mission(uri);
  if (document && document.uri.scheme !== "file") {
    await vscode.window.showWarningMessage("Save this mission to a file first.");
    return undefined;
  }
  return (await document?.save()) ? document : undefined;
}

/** Where commands run, and build/ is: the workspace folder, or the file's own. @param {vscode.Uri} uri */
function folderOf(uri) {
  return vscode.workspace.getWorkspaceFolder(uri)?.uri.fsPath ?? path.dirname(uri.fsPath);
}

/** @param {vscode.Uri} [uri] */
function programOf(uri) {
  const folder = (uri && vscode.workspace.getWorkspaceFolder(uri)) ?? vscode.workspace.workspaceFolders?.[0];
  const setting = vscode.workspace.getConfiguration("missionc", uri).get("path", "missionc");
  return programPath(setting, folder?.uri.fsPath, os.homedir());
}

module.exports = { activate, deactivate };
