// The map beside the text: it follows the mission that is edited, and a drag on it edits the text.
"use strict";

const path = require("node:path");
const vscode = require("vscode");

/** @typedef {{ version: number, whole: boolean, scene: object | null }} Drawn */
/** @typedef {{ ready?: true, select?: [number, number], edits?: { from: number, to: number, insert: string }[], version?: number }} Told */

class MapPreview {
  /** @type {vscode.WebviewPanel | undefined} */
  panel;
  /** @type {vscode.TextDocument | undefined} */
  document;
  asking = false;
  again = false;

  /** @param {(document: vscode.TextDocument) => Promise<Drawn | null>} ask what the server says of a text */
  constructor(ask) {
    this.ask = ask;
    this.heard = [
      vscode.workspace.onDidChangeTextDocument((change) => {
        if (change.document === this.document) return this.refresh();
      }),
      vscode.window.onDidChangeActiveTextEditor((editor) => {
        if (this.panel && editor?.document.languageId === "mission") return this.show(editor.document);
      }),
      vscode.window.onDidChangeTextEditorSelection(({ textEditor, selections }) => {
        if (textEditor.document === this.document) this.post({ cursor: textEditor.document.offsetAt(selections[0].active) });
      }),
    ];
  }

  dispose() {
    this.heard.forEach((each) => each.dispose());
    this.panel?.dispose();
  }

  /** @param {vscode.TextDocument} document */
  async show(document) {
    this.document = document;
    this.panel ??= this.open();
    this.panel.title = `${path.basename(document.uri.fsPath)}: map`;
    await this.refresh();
  }

  reveal() {
    this.panel?.reveal(undefined, true);
  }

  open() {
    const beside = { viewColumn: vscode.ViewColumn.Beside, preserveFocus: true };
    const panel = vscode.window.createWebviewPanel("missionc.map", "map", beside, {
      enableScripts: true,
      localResourceRoots: [vscode.Uri.file(__dirname)],
      retainContextWhenHidden: true,
    });
    panel.onDidDispose(() => {
      this.panel = undefined;
      this.document = undefined;
    });
    panel.webview.onDidReceiveMessage((told) => this.told(told));
    panel.webview.html = page(panel.webview);
    return panel;
  }

  /** Draw the text as it is now; while the server still draws, once more after that. */
  async refresh() {
    this.again = true;
    if (this.asking) return;
    this.asking = true;
    try {
      while (this.again && this.document) {
        this.again = false;
        const document = this.document;
        const drawn = await this.ask(document).catch(() => null);
        if (drawn && document === this.document && drawn.version === document.version) {
          this.post({ ...drawn, name: document.uri.toString() });
        }
      }
    } finally {
      this.asking = false;
    }
  }

  /** @param {object} message */
  post(message) {
    this.panel?.webview.postMessage(message);
  }

  /** What was done on the map. @param {Told} told */
  async told({ ready, select, edits, version }) {
    const document = this.document;
    if (!document) return;
    /** @param {number} from @param {number} to */
    const range = (from, to) => new vscode.Range(document.positionAt(from), document.positionAt(to));
    if (ready) await this.refresh();
    if (select) {
      const open = vscode.window.visibleTextEditors.find((editor) => editor.document === document);
      await vscode.window.showTextDocument(document, { viewColumn: open?.viewColumn ?? vscode.ViewColumn.One, selection: range(...select) });
    }
    if (edits) {
      const edit = new vscode.WorkspaceEdit();
      for (const { from, to, insert } of edits) edit.replace(document.uri, range(from, to), insert);
      // Of another version the places are not those of this text: the map goes back to what it says.
      if (version !== document.version || !(await vscode.workspace.applyEdit(edit))) await this.refresh();
    }
  }
}

/** @param {vscode.Webview} webview */
function page(webview) {
  /** @param {string} name */
  const file = (name) => webview.asWebviewUri(vscode.Uri.file(path.join(__dirname, name)));
  return `<!doctype html>
<html lang="en">
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; script-src ${webview.cspSource}; style-src ${webview.cspSource}">
<title>map</title>
<link rel="stylesheet" href="${file("map.css")}">
<body>
<main>
<div class="tools"><button id="fit">Fit</button><button id="zoom-in" aria-label="Zoom in">+</button><button id="zoom-out" aria-label="Zoom out">−</button></div>
<p id="empty">No map: the text has no valid <code>world</code>.</p>
<svg id="map" hidden></svg>
</main>
<script src="${file("map.js")}"></script>
</html>
`;
}

module.exports = { MapPreview };
