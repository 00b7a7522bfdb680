// Findings: below the words in the text, and in a list under it, with the edits that mend them.
import { lintGutter, setDiagnostics } from "@codemirror/lint";
import { LSPPlugin } from "@codemirror/lsp-client";

const SEVERITIES = { 1: "error", 2: "warning", 3: "info", 4: "hint" };

export class Findings {
  constructor(list, count) {
    this.list = list;
    this.count = count;
    this.checked = [];
    this.compiled = [];
  }

  extension = () => lintGutter();

  // The language server's findings of a version of the text, and then what mends them.
  async publish(client, { uri, version, diagnostics }) {
    const file = client.workspace.getFile(uri);
    const view = file?.getView();
    const plugin = view && LSPPlugin.get(view);
    if (!plugin || (version != null && version !== file.version)) return;
    this.checked = diagnostics.map((item) => this.finding(plugin, item));
    this.show(view);
    if (!diagnostics.length) return;
    const whole = { start: { line: 0, character: 0 }, end: plugin.toPosition(plugin.syncedDoc.length, plugin.syncedDoc) };
    const mended = await client
      .request("textDocument/codeAction", { textDocument: { uri }, range: whole, context: { diagnostics } })
      .catch(() => null);
    if (!mended?.length || file.version !== version) return;
    diagnostics.forEach((item, index) => {
      const of = mended.filter(({ diagnostics: about }) => about?.some((each) => same(each, item)));
      this.checked[index].actions = of.map((action) => this.action(plugin, uri, action));
    });
    this.show(view);
  }

  // What a compilation found in the text as it was then; gone as soon as the text is another.
  setCompiled(view, items) {
    const plugin = LSPPlugin.get(view);
    this.compiled = plugin ? items.map((item) => this.finding(plugin, item)) : [];
    this.show(view);
  }

  forget(view) {
    if (!this.compiled.length) return;
    this.compiled = [];
    queueMicrotask(() => this.show(view));
  }

  finding(plugin, item) {
    const at = (position) => plugin.unsyncedChanges.mapPos(plugin.fromPosition(position, plugin.syncedDoc));
    return {
      from: at(item.range.start),
      to: at(item.range.end),
      severity: SEVERITIES[item.severity ?? 1],
      source: item.code,
      message: item.message,
      actions: [],
    };
  }

  action = (plugin, uri, { title, edit }) => ({
    name: title,
    apply(view) {
      const at = (position) => plugin.unsyncedChanges.mapPos(plugin.fromPosition(position, plugin.syncedDoc));
      const changes = edit.changes[uri].map(({ range, newText }) => ({ from: at(range.start), to: at(range.end), insert: newText }));
      view.dispatch({ changes, userEvent: "input.fix" });
      view.focus();
    },
  });

  show(view) {
    const known = new Set(this.checked.map(({ source, from }) => `${source} ${from}`));
    const all = [...this.checked, ...this.compiled.filter(({ source, from }) => !known.has(`${source} ${from}`))];
    view.dispatch(setDiagnostics(view.state, all));
    this.list.replaceChildren(...all.map((finding) => this.item(view, finding)));
    const of = (severity, word) => {
      const many = all.filter((finding) => finding.severity === severity).length;
      return many ? `${many} ${word}${many > 1 ? "s" : ""}` : "";
    };
    this.count.textContent = [of("error", "error"), of("warning", "warning")].filter(Boolean).join(", ") || "no findings";
    this.count.dataset.state = all.some(({ severity }) => severity === "error") ? "error" : all.length ? "warning" : "none";
  }

  item(view, finding) {
    const item = document.createElement("li");
    item.dataset.severity = finding.severity;
    const go = document.createElement("button");
    go.type = "button";
    const line = view.state.doc.lineAt(Math.min(finding.from, view.state.doc.length));
    const [first, ...rest] = finding.message.split("\n");
    const place = document.createElement("span");
    place.className = "place";
    place.textContent = `${line.number}:${finding.from - line.from + 1} ${finding.source ?? ""}`;
    go.append(place, ` ${first}`);
    go.addEventListener("click", () => {
      view.dispatch({ selection: { anchor: finding.from, head: finding.to }, scrollIntoView: true });
      view.focus();
    });
    item.append(go);
    for (const words of rest) item.append(Object.assign(document.createElement("p"), { textContent: words }));
    for (const action of finding.actions) {
      const button = Object.assign(document.createElement("button"), { type: "button", textContent: action.name, className: "fix" });
      button.addEventListener("click", () => action.apply(view));
      item.append(button);
    }
    return item;
  }
}

const same = (one, other) => one.code === other.code && one.message === other.message && JSON.stringify(one.range) === JSON.stringify(other.range);
