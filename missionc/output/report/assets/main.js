// One state; whatever changes it asks for a frame, and the frame draws what it touches.
const whole = JSON.parse(document.getElementById("data").textContent);
const { data, rank } = chosenPlan(whole);
const model = readModel(data);
const state = {
  time: 0,
  playing: false,
  speed: SPEEDS.find((speed) => model.horizon / speed <= 20) || SPEEDS[SPEEDS.length - 1],
  focus: -1,
  hovered: null,
  selected: null,
  shown: null,
  follow: "planned",
  graph: model.graphs.length ? model.graphs[0].name : "",
  layers: { paths: true, trails: true, names: true, turning: false },
  crowd: model.agents > 16,
  theme: matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light",
};
const view = new URLSearchParams(location.hash.slice(1));
let asked = false;
let stale = true;

function change(changes = {}) {
  if ("focus" in changes && changes.focus !== state.focus) stale = true;
  if ("theme" in changes) stale = true;
  Object.assign(state, changes);
  state.shown = state.hovered ?? state.selected;
  if (asked) return;
  asked = true;
  requestAnimationFrame(frame);
}

const palette = () => (state.theme === "dark" ? DARK : LIGHT);

function frame() {
  asked = false;
  if (state.layers.turning) map.turn(0.004, 0);
  if (stale) {
    document.documentElement.dataset.theme = state.theme;
    paintAgents();
    tracks.draw(palette());
    stale = false;
  }
  map.draw(palette());
  tracks.update();
  clockwork.update();
  tell();
  if (state.layers.turning) change();
}

function paintAgents() {
  for (const button of document.querySelectorAll("#agents button")) {
    button.setAttribute("aria-pressed", String(Number(button.dataset.agent) === state.focus));
    button.firstChild.style.background = colourOf(palette(), Number(button.dataset.agent));
  }
}

// A link may say what to show first, as in `report.html#t=8&play`. A page that shows one report after the other asks
// (`follow`) to be told what is shown, to say so of the next.
function open() {
  const time = Number(view.get("t"));
  if (Number.isFinite(time)) state.time = model.within(time);
  if (SPEEDS.includes(Number(view.get("speed")))) state.speed = Number(view.get("speed"));
  if (["dark", "light"].includes(view.get("theme"))) state.theme = view.get("theme");
  state.playing = view.has("play") && state.time < model.horizon;
}

function tell() {
  if (!view.has("follow") || parent === window) return;
  const shown = new URLSearchParams({ t: state.time.toFixed(3), speed: state.speed, theme: state.theme });
  if (state.playing) shown.set("play", "");
  parent.postMessage({ shown: String(shown) }, "*");
}

function describe() {
  document.getElementById("title").textContent = data.mission;
  const many = (count, noun) => `${count} ${noun}${count === 1 ? "" : "s"}`;
  const about = [many(model.agents, "agent"), `${many(data.steps, "step")} of ${data.step} s`, data.backend && (data.miss ? `a motion of ${data.backend}` : `planned by ${data.backend}`), `seed ${data.seed}`, data.proven];
  document.getElementById("about").textContent = about.filter(Boolean).join(" · ");
  const verdict = document.getElementById("verdict");
  verdict.textContent = data.miss ? `✗ no plan: ${data.miss}` : data.passed ? "✓ verified" : "✗ not verified";
  verdict.className = data.passed ? "holds" : "fails";
  document.getElementById("map").setAttribute("aria-label", `The world of ${data.mission} with ${many(model.agents, "agent")} in motion`);
  const legend = document.getElementById("legend");
  legend.textContent = "";
  for (const [name, text] of [
    ["holds", "true"],
    ["fails", "false"],
    ["open", "open, time can still change it"],
  ]) {
    const swatch = document.createElement("span");
    swatch.className = `swatch ${name}`;
    legend.append(swatch, text);
  }
  legend.append(" · height is robustness, pale is asked by no requirement, values to 1 mm · keys: space plays, ← → step, ↑ ↓ lanes, Enter source, < > speed, T theme");
  if (model.dimension === 3) legend.append(" · on the map: drag, or A D W S, turns, + − zooms");
}

open();
const words = missionWords(model, (file, start, end) => {
  const inside = ([number, from, to]) => number === file && from >= start && from < end && to > start;
  const lane = data.lanes.findIndex((each) => each.place && inside(each.place));
  if (lane >= 0 && lane !== state.selected) tracks.select(lane);
});
const map = scene(model, state, change);
const tracks = timeline(model, state, change, words);
const clockwork = player(model, state, change);
margins(model, change);
plansTable(whole, rank, state);
describe();

document.getElementById("theme").addEventListener("click", () => change({ theme: state.theme === "dark" ? "light" : "dark" }));
window.addEventListener("resize", () => {
  stale = true;
  change();
});
let before = null;
window.addEventListener("beforeprint", () => {
  before = state.theme;
  Object.assign(state, { theme: "light", playing: false });
  stale = true;
  frame();
});
window.addEventListener("afterprint", () => change({ theme: before }));
change();
