// The editor: CodeMirror with the language server's help, and the drags of the map as single steps that undo takes back.
import { autocompletion, closeBrackets, closeBracketsKeymap, completionKeymap } from "@codemirror/autocomplete";
import { defaultKeymap, history, historyKeymap, indentWithTab, isolateHistory } from "@codemirror/commands";
import { bracketMatching, indentOnInput } from "@codemirror/language";
import { lintKeymap } from "@codemirror/lint";
import { formatKeymap, hoverTooltips, jumpToDefinitionKeymap, LSPPlugin, renameKeymap, serverCompletion } from "@codemirror/lsp-client";
import { highlightSelectionMatches, searchKeymap } from "@codemirror/search";
import { Annotation, Compartment, EditorSelection, EditorState, Transaction } from "@codemirror/state";
import { drawSelection, EditorView, highlightActiveLine, highlightActiveLineGutter, keymap, lineNumbers } from "@codemirror/view";
import { highlighting } from "./language.js";

const dragged = Annotation.define();
const PAUSE = 120; // milliseconds without a key after which the server hears of the text

export class Editor {
  // `heard`: changed(changes, dragged) and cursor(position), of what happens in the text.
  constructor(parent, { nonce, language, findings, keys, heard }) {
    this.heard = heard;
    this.night = false;
    this.server = new Compartment();
    this.theme = new Compartment();
    this.pending = 0;
    this.drag = null;
    this.extensions = [
      EditorView.cspNonce.of(nonce),
      this.server.of([]),
      this.theme.of([]),
      EditorView.lineWrapping,
      lineNumbers(),
      highlightActiveLine(),
      highlightActiveLineGutter(),
      history(),
      drawSelection(),
      indentOnInput(),
      bracketMatching(),
      closeBrackets(),
      autocompletion(),
      highlightSelectionMatches(),
      language,
      highlighting,
      findings.extension(),
      keymap.of([...keys, indentWithTab, ...formatKeymap, ...renameKeymap, ...jumpToDefinitionKeymap, ...closeBracketsKeymap]),
      keymap.of([...completionKeymap, ...searchKeymap, ...lintKeymap, ...historyKeymap, ...defaultKeymap]),
      EditorView.contentAttributes.of({ "aria-label": "the mission" }),
      EditorView.updateListener.of((update) => this.update(update)),
    ];
    this.view = new EditorView({ parent, state: EditorState.create({ extensions: this.extensions }) });
  }

  get text() {
    return this.view.state.doc.toString();
  }

  // Another text, with nothing to undo.
  open(text, client, uri) {
    this.view.setState(EditorState.create({ doc: text, extensions: this.extensions }));
    this.dark(this.night);
    this.connect(client, uri);
  }

  // The same text under another name.
  connect(client, uri) {
    const help = [serverCompletion({ override: true }), hoverTooltips({ hoverTime: 250 })];
    this.view.dispatch({ effects: this.server.reconfigure([client.plugin(uri, "mission"), ...help]) });
  }

  disconnect() {
    this.view.dispatch({ effects: this.server.reconfigure([]) });
  }

  dark(on) {
    this.night = on;
    this.view.dispatch({ effects: this.theme.reconfigure(EditorView.theme({}, { dark: on })) });
  }

  // The whole text by another, which undo takes back.
  replace(text) {
    this.view.dispatch({ changes: { from: 0, to: this.view.state.doc.length, insert: text }, annotations: isolateHistory.of("full") });
  }

  select([from, to]) {
    this.view.dispatch({ selection: EditorSelection.range(from, to), effects: EditorView.scrollIntoView(from, { y: "center" }) });
  }

  sync() {
    clearTimeout(this.pending);
    this.pending = 0;
    LSPPlugin.get(this.view)?.client.sync();
  }

  // What the server has not heard yet; nothing where it has heard everything.
  unsent() {
    const changes = LSPPlugin.get(this.view)?.unsyncedChanges;
    return changes && !changes.empty ? changes : null;
  }

  begin() {
    this.drag = { before: this.view.state.doc, changes: null };
  }

  preview(changes) {
    this.view.dispatch({ changes, annotations: [dragged.of(true), Transaction.addToHistory.of(false)] });
  }

  // What a drag changed, made once more as one step of its own.
  end(cancelled) {
    const { before, changes } = this.drag;
    this.drag = null;
    if (!changes) return;
    this.view.dispatch({ changes: changes.invert(before), annotations: [dragged.of(true), Transaction.addToHistory.of(false)] });
    if (cancelled) return;
    this.view.dispatch({ changes, annotations: [dragged.of(true), isolateHistory.of("full")], userEvent: "move.shape" });
  }

  update(update) {
    if (update.docChanged) {
      const own = update.transactions.some((transaction) => transaction.annotation(dragged));
      if (this.drag) this.drag.changes = this.drag.changes ? this.drag.changes.compose(update.changes) : update.changes;
      this.heard.changed(update.changes, own);
      clearTimeout(this.pending);
      this.pending = setTimeout(() => this.sync(), PAUSE);
    }
    if (update.selectionSet || update.docChanged) this.heard.cursor(update.state.selection.main.head);
  }
}
