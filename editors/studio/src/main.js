// The page: the text, the map and the plan, joined.
import { LSPClient } from "@codemirror/lsp-client";
import { connection } from "./connection.js";
import { ask, choose } from "./dialogs.js";
import { Editor } from "./editor.js";
import { Findings } from "./findings.js";
import { missionLanguage } from "./language.js";
import { plainMarkup } from "./markup.js";
import { PlanView } from "./plan_view.js";
import { WorldView } from "./world_view.js";

const byId = (id) => document.getElementById(id);
const CANCEL = ["", "Cancel"];
const BUSY = 20000; // milliseconds that an answer may take

async function begin() {
  const socket = connection(() => say("The studio has ended. Unsaved text exists only on this page: copy it before you close the page.", true));
  await socket.opened;
  const client = new LSPClient({
    timeout: BUSY,
    sanitizeHTML: plainMarkup,
    notificationHandlers: {
      "textDocument/publishDiagnostics": (_, params) => (findings.publish(client, params), true),
      "studio/scene": (_, params) => (show(params), true),
      "studio/progress": (_, { line }) => (plan.progress(line), true),
      "studio/ended": (_, params) => (ended(params), true),
    },
  }).connect(socket.transport);
  const first = await client.request("studio/begin", {});
  let mission = first;
  let clean = first.saved ? first.text : null;
  const lost = () => title() && editor.text !== mission.text; // whether something would go with the page

  const plan = new PlanView();
  const findings = new Findings(byId("list"), byId("count"));
  const heard = {
    changed(changes, dragged) {
      world.carry(changes, dragged);
      findings.forget(editor.view);
      plan.outdated();
      title();
    },
    cursor: (at) => world.light(at),
  };
  const editor = new Editor(byId("editor"), {
    nonce: document.querySelector("meta[name=csp-nonce]").content,
    language: missionLanguage(first.words),
    findings,
    keys: [
      { key: "Mod-s", run: () => (save(), true), preventDefault: true },
      { key: "Mod-o", run: () => (open(), true), preventDefault: true },
      { key: "Mod-Enter", run: () => (compile(), true), preventDefault: true },
    ],
    heard,
  });
  const world = new WorldView(byId("map"), {
    begin: () => editor.begin(),
    preview: (changes) => editor.preview(changes),
    end: (cancelled) => editor.end(cancelled),
    select: (span) => editor.select(span),
    focus: () => editor.view.focus(),
  });

  function show({ uri, version, whole, scene }) {
    const file = client.workspace.getFile(uri);
    if (uri !== mission.uri || !file || version !== file.version) return;
    world.show(scene, whole);
    const unsent = editor.unsent();
    if (unsent) world.carry(unsent, false);
    byId("empty").hidden = Boolean(scene);
    world.svg.toggleAttribute("hidden", !scene);
  }

  function title() {
    const dirty = editor.text !== clean;
    byId("name").textContent = mission.name;
    byId("dirty").hidden = !dirty;
    byId("where").textContent = mission.named ? mission.folder : `unsaved; target folder: ${mission.folder}`;
    document.title = `${dirty ? "● " : ""}${mission.name}`;
    return dirty;
  }

  function load(opened) {
    editor.disconnect();
    mission = opened;
    clean = opened.saved ? opened.text : null;
    world.clear();
    editor.open(opened.text, client, opened.uri);
    title();
    quiet();
  }

  async function open() {
    const chosen = await choose(await client.request("studio/lists", {}));
    if (!chosen) return;
    if (lost()) {
      const [sure] = await ask(`${mission.name} has unsaved changes.`, [["leave", "Open without saving"], CANCEL]);
      if (sure !== "leave") return;
    }
    const opened = await client.request("studio/open", chosen);
    if (opened.problem) return say(opened.says, true);
    load(opened);
    tab("text");
  }

  async function save(name = "", replace = false) {
    const text = editor.text;
    const answer = await client.request("studio/save", { text, name, replace });
    if (answer.problem === "unnamed") return saveAs();
    if (answer.problem === "refused") return say(answer.says, true);
    if (answer.problem === "exists") {
      const [sure] = await ask(`A file with this name exists.`, [["replace", "Replace the file"], CANCEL]);
      return sure && save(name, true);
    }
    if (answer.problem === "changed") return conflict();
    const renamed = answer.uri !== mission.uri;
    mission = answer;
    clean = text;
    if (renamed) {
      editor.disconnect();
      editor.connect(client, mission.uri);
    } else client.notification("textDocument/didSave", { textDocument: { uri: mission.uri } });
    title();
    say(`saved as ${[`${mission.folder}/${mission.name}`, ...answer.beside].join(", with ")}`);
  }

  async function saveAs() {
    const [sure, name] = await ask(`Save in ${mission.folder} as`, [["save", "Save"], CANCEL], { label: "File name", value: mission.name });
    if (sure && name) await save(name);
  }

  async function conflict() {
    const words = `${mission.name} changed on disk after the studio read it.`;
    const [way] = await ask(words, [["replace", "Overwrite the file"], ["load", "Load the file (undo restores this text)"], CANCEL]);
    if (way === "replace") await save("", true);
    if (way !== "load") return;
    const read = await client.request("studio/reload", {});
    if (read.problem) return say(read.says, true);
    mission = read;
    clean = read.text;
    editor.replace(read.text);
    title();
  }

  async function compile() {
    editor.sync();
    plan.begin();
    tab("plan");
    quiet();
    await client.request("studio/compile", {}).catch((error) => (plan.stopped(), say(String(error.message), true)));
  }

  async function stop() {
    await client.request("studio/stop", {});
    plan.stopped();
  }

  function ended(params) {
    if (!plan.running) return;
    plan.end(params);
    const file = client.workspace.getFile(mission.uri);
    if (file && params.version === file.version && !editor.unsent()) findings.setCompiled(editor.view, params.findings);
    else plan.outdated();
  }

  async function keep(replace = false) {
    const { problem, says } = await client.request("studio/keep", { replace });
    if (problem !== "exists" || replace) return say(says, problem !== "");
    const [sure] = await ask(says, [["replace", "Replace the folder"], CANCEL]);
    if (sure) await keep(true);
  }

  function say(words, wrong = false) {
    const notice = byId("notice");
    notice.textContent = words;
    notice.dataset.state = wrong ? "wrong" : "done";
    notice.hidden = false;
  }

  const quiet = () => (byId("notice").hidden = true);

  function tab(name) {
    document.body.dataset.shown = name;
    for (const each of ["text", "world", "plan"]) {
      const chosen = name === each || (each === "world" && name === "text" && !matchMedia("(max-width: 900px)").matches);
      byId(`tab-${each}`).setAttribute("aria-selected", String(chosen));
    }
  }

  function theme(dark) {
    document.documentElement.dataset.theme = dark ? "dark" : "light";
    editor.dark(dark);
  }

  byId("show-open").addEventListener("click", open);
  byId("save").addEventListener("click", () => save());
  byId("save-as").addEventListener("click", saveAs);
  byId("compile").addEventListener("click", compile);
  byId("stop").addEventListener("click", stop);
  byId("keep").addEventListener("click", () => keep());
  byId("fit").addEventListener("click", () => world.fit());
  byId("zoom-in").addEventListener("click", () => world.zoom(1.25));
  byId("zoom-out").addEventListener("click", () => world.zoom(0.8));
  byId("theme").addEventListener("click", () => theme(document.documentElement.dataset.theme !== "dark"));
  for (const each of ["text", "world", "plan"]) byId(`tab-${each}`).addEventListener("click", () => tab(each));
  window.addEventListener("beforeunload", (event) => {
    if (lost()) event.preventDefault();
  });
  window.addEventListener("keydown", (event) => {
    const act = (event.ctrlKey || event.metaKey) && { s: save, o: open, Enter: compile }[event.key];
    if (!act || event.defaultPrevented || document.querySelector("dialog[open]")) return;
    event.preventDefault();
    act();
  });

  tab("text");
  load(first);
  theme(matchMedia("(prefers-color-scheme: dark)").matches);
  editor.view.focus();
}

begin();
