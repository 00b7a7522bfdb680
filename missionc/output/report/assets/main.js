// One state; whatever changes it asks for a frame, and the frame draws what it touches.
const whole = JSON.parse(document.getElementById("data").textContent);
const { data, rank } = chosenPlan(whole);
const model = readModel(data);
const other = whole.compare ? readModel(whole.compare.other) : null;
const state = shownFirst(model, other);
const view = fragment();
let asked = false;
let [stale, layout, telling] = [true, true, true];

// Of these, everything else on the page may depend; the others move the map and the clock alone.
function change(changes = {}) {
  const names = Object.keys(changes);
  if (names.some((name) => ["focus", "theme"].includes(name) && changes[name] !== state[name])) stale = true;
  if (changes.layout) layout = true;
  if (names.some((name) => name !== "time") || !state.playing) telling = true;
  Object.assign(state, changes);
  delete state.layout;
  state.shown = state.hovered ?? state.selected;
  if (asked) return;
  asked = true;
  requestAnimationFrame(frame);
}

const palette = () => (state.theme === "dark" ? DARK : LIGHT);

function frame() {
  asked = false;
  if (stale) {
    document.documentElement.dataset.theme = state.theme;
    paintAgents();
  }
  if (layout) tracks.measured();
  if (stale || layout) tracks.draw(palette(), stale);
  [stale, layout] = [false, false];
  map.draw(palette());
  tracks.update();
  clockwork.update();
  if (telling) {
    map.update();
    bar.later();
  }
  telling = false;
  tell();
}

function paintAgents() {
  for (const button of document.querySelectorAll("#agents button")) {
    button.setAttribute("aria-pressed", String(Number(button.dataset.agent) === state.focus));
    button.firstChild.style.color = colourOf(palette(), model.style[Number(button.dataset.agent)]);
  }
}

// A page that shows one report after the other asks (`follow`) to be told what is shown, to say so of the next.
let told = "";
function tell() {
  if (!view.has("follow") || parent === window) return;
  const shown = writeAddress(model, state, map.view.camera, []);
  if (shown !== told) parent.postMessage({ shown }, "*");
  told = shown;
}

// Of a mission of which something was flown: what is over.
const begun = (past) => past && [`plan start: ${tidy(past.begins)} s after the start of the flight (times count from the plan start)`, past.lost.length && `lost agents: ${past.lost.join(", ")}`, past.given_up.length && `dropped requirements: ${past.given_up.join(", ")}`].filter(Boolean).join("; ");

function describe() {
  const put = (id, text) => (document.getElementById(id).textContent = text);
  const many = (count, noun) => `${count} ${noun}${count === 1 ? "" : "s"}`;
  put("title", data.mission);
  const planned = data.backend && !data.miss && `planned by ${data.backend}`;
  put("about", [many(model.agents, "agent"), `${many(data.steps, "step")} of ${data.step} s`, planned, data.solved, `seed ${data.seed}`, data.proven, begun(data.past)].filter(Boolean).join(" · "));
  const marks = { holds: "✓", steps: "◐", fails: "✗" };
  const badge = document.getElementById("verdict");
  badge.className = data.badge.state;
  const verdict = ({ state: mark, says }) => `${marks[mark]} ${says.replaceAll("`", "")}`;
  put("verdict", other ? `A ${verdict(data.badge)} · B ${verdict(other.data.badge)}` : verdict(data.badge));
  // The day is the file's own: what the page says is the same whenever it is made.
  const day = new Date(document.lastModified);
  const made = Number.isNaN(day.getTime()) ? "" : `file date ${day.toISOString().slice(0, 10)}`;
  put("origin", [`missionc ${data.version}`, made, data.digest && `plan SHA-256 ${data.digest.slice(0, 12)}`].filter(Boolean).join(" · "));
  document.getElementById("origin").title = data.digest ? `SHA-256 of plan.json: ${data.digest}` : "";
  document.getElementById("map").setAttribute("aria-label", `Map of ${data.mission} with ${many(model.agents, "moving agent")}`);
  if (other) put("about", ["A", "B"].map((name, at) => `${name} ${whole.compare.names[at]}, ${(at ? other.data : data).backend}, seed ${(at ? other.data : data).seed}`).join(" · "));
}

readAddress(model, state, view, { set: (camera) => (state.looked = camera) });
const words = missionWords(model, (file, start, end) => {
  const inside = ([number, from, to]) => number === file && from >= start && from < end && to > start;
  const lane = data.lanes.findIndex((each) => each.place && inside(each.place));
  if (lane >= 0 && lane !== state.selected) tracks.select(lane);
});
const map = scene(model, state, change, other);
if (state.looked) map.view.camera.set(state.looked);
const bar = addressBar(model, state, map.view.camera);
const tracks = timeline(model, state, change, words, other);
const clockwork = player(model, state, change);
phaseBar(model);
margins(model, change);
stagesTable(data.stages);
plansTable(whole, rank, bar.whole);
suggestionCards(whole, rank, bar.whole);
loopFlights(model, change);
exportMenu(model, state, change, { paint: (context, width, height) => map.paint(context, width, height, palette()), size: map.size });
splitters(change);
fullScreen(state, change);
describe();
if (state.selected !== null) {
  words.show(data.lanes[state.selected].place);
  tracks.reveal(state.selected);
}

document.getElementById("theme").addEventListener("click", () => change({ theme: state.theme === "dark" ? "light" : "dark" }));
document.getElementById("copy").addEventListener("click", async () => {
  const said = document.getElementById("said");
  try {
    await navigator.clipboard.writeText(bar.whole());
    said.textContent = "link copied";
  } catch {
    said.textContent = bar.whole();
  }
});
window.addEventListener("keydown", (event) => event.key === "Escape" && change({ measuring: false, ruler: null, followed: -1 }));
window.addEventListener("hashchange", () => {
  readAddress(model, state, fragment(), map.view.camera);
  change({});
});
new ResizeObserver(() => {
  stale = true;
  change({ layout: true });
}).observe(document.querySelector("main"));
let before = null;
window.addEventListener("beforeprint", () => {
  before = state.theme;
  Object.assign(state, { theme: "light", playing: false });
  [stale, layout] = [true, true];
  frame();
});
window.addEventListener("afterprint", () => change({ theme: before }));
change();
