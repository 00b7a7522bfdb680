// The page of the map: the studio's view of a scene, between what the extension sends and what it is told.
import { WorldView } from "../../studio/src/world_view.js";

const host = acquireVsCodeApi();
const byId = (id) => document.getElementById(id);
let shown = null; // the last message with a scene
let edits = null; // of the drag that is under way, by where they begin; the text has them when it ends

const view = new WorldView(byId("map"), {
  begin: () => (edits = new Map()),
  preview: (found) => found.forEach((edit) => edits.set(edit.from, edit)),
  end(cancelled) {
    if (!cancelled && edits.size) host.postMessage({ edits: [...edits.values()], version: edits.version ?? shown.version });
    edits = null;
    if (cancelled) draw();
  },
  select: (span) => span && host.postMessage({ select: span }),
  focus: () => {},
});

function draw() {
  const { scene, whole, name } = structuredClone(shown);
  byId("empty").hidden = Boolean(scene);
  byId("map").toggleAttribute("hidden", !scene);
  byId("map").setAttribute("aria-label", `the map of ${name}`);
  view.show(scene, whole);
}

window.addEventListener("message", ({ data }) => {
  if (data.cursor !== undefined) return view.light(data.cursor);
  const another = shown?.name !== data.name;
  if (edits) edits.version ??= shown.version; // a drag edits the text that it began in, and no other
  shown = data;
  if (another) view.clear();
  if (!edits) draw();
});

byId("fit").addEventListener("click", () => view.fit());
byId("zoom-in").addEventListener("click", () => view.zoom(1.25));
byId("zoom-out").addEventListener("click", () => view.zoom(0.8));

const theme = () => (document.documentElement.dataset.theme = /vscode-(dark|high-contrast(?!-light))/.test(document.body.className) ? "dark" : "light");
new MutationObserver(theme).observe(document.body, { attributeFilter: ["class"] });
theme();
host.postMessage({ ready: true });
