// What is shown, as it stands in the address: `#t=8&speed=2&lane=3&agent=drone[0]&follow&view=…`.
const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 5, 10, 25, 100];

const shownFirst = (model, other) => ({
  time: 0,
  playing: false,
  speed: SPEEDS.find((speed) => model.horizon / speed <= 20) || SPEEDS[SPEEDS.length - 1],
  focus: -1,
  followed: -1,
  pointed: -1,
  pointedObstacle: -1,
  hovered: null,
  selected: null,
  shown: null,
  measuring: false,
  ruler: null,
  motion: model.data.loop && model.motions.simulated ? "simulated" : "planned",
  compare: other ? "side" : "",
  trail: Number((0.25 * model.horizon).toPrecision(2)),
  graph: model.graphs.length ? model.graphs[0].name : "",
  layers: { paths: true, names: true },
  wide: false,
  theme: matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light",
});

const fragment = () => new URLSearchParams(location.hash.slice(1));

// What an address asks for; what it does not name, or what there is not, is left as it is.
function readAddress(model, state, view, eye) {
  const agentNamed = (name) => model.data.agents.findIndex((agent) => agent.name === name);
  const time = Number(view.get("t"));
  if (view.has("t") && Number.isFinite(time)) state.time = model.within(time);
  if (SPEEDS.includes(Number(view.get("speed")))) state.speed = Number(view.get("speed"));
  if (["dark", "light"].includes(view.get("theme"))) state.theme = view.get("theme");
  if (view.has("lane") && model.lanes[view.get("lane")]) state.selected = Number(view.get("lane"));
  if (agentNamed(view.get("agent")) >= 0) state.focus = agentNamed(view.get("agent"));
  if (view.has("chase") && state.focus >= 0) state.followed = state.focus;
  if (model.motions[view.get("motion")]) state.motion = view.get("motion");
  if (view.has("graph") && ["", ...model.graphs.map((graph) => graph.name)].includes(view.get("graph"))) state.graph = view.get("graph");
  if (Number(view.get("trail")) >= 0 && view.has("trail")) state.trail = Math.min(Number(view.get("trail")), model.horizon);
  if (state.compare && ["side", "skin"].includes(view.get("compare"))) state.compare = view.get("compare");
  for (const name of Object.keys(state.layers)) if (view.has("hide")) state.layers[name] = !view.get("hide").split(",").includes(name);
  const numbers = (view.get("view") || "").split(",").map(Number);
  if (numbers.length === 6 && numbers.every(Number.isFinite)) {
    const [turn, tilt, zoom, ...target] = numbers;
    eye.set({ turn, tilt, zoom, target });
  }
  state.playing = view.has("play") && state.time < model.horizon;
}

// The same written; a camera that nobody moved is left out.
function writeAddress(model, state, eye, kept) {
  const shown = new URLSearchParams();
  for (const name of kept) if (fragment().has(name)) shown.set(name, fragment().get(name));
  const names = (agent) => model.data.agents[agent].name;
  shown.set("t", String(Number(state.time.toFixed(3))));
  shown.set("speed", state.speed);
  shown.set("theme", state.theme);
  if (state.selected !== null) shown.set("lane", state.selected);
  if (state.focus >= 0) shown.set("agent", names(state.focus));
  if (state.followed >= 0 && state.followed === state.focus) shown.set("chase", "");
  if (state.motion !== shownFirst(model).motion) shown.set("motion", state.motion);
  if (model.graphs.length && state.graph !== model.graphs[0].name) shown.set("graph", state.graph);
  if (state.trail !== shownFirst(model).trail) shown.set("trail", state.trail);
  if (state.compare) shown.set("compare", state.compare);
  const hidden = Object.keys(state.layers).filter((name) => !state.layers[name]);
  if (hidden.length) shown.set("hide", hidden.join());
  const { turn, tilt, zoom, target } = eye.get();
  if (state.looked) shown.set("view", [turn, tilt, zoom, ...target].map((value) => Number(value.toFixed(4))).join());
  if (state.playing) shown.set("play", "");
  return String(shown);
}

// Kept in the address bar while nothing plays; a browser that forbids it (in a frame) has the button.
function addressBar(model, state, eye) {
  let waiting = null;
  return {
    whole: () => `${location.href.split("#")[0]}#${writeAddress(model, state, eye, ["plan", "follow"])}`,
    later() {
      if (state.playing || waiting || parent !== window) return;
      waiting = setTimeout(() => {
        waiting = null;
        try {
          history.replaceState(null, "", `#${writeAddress(model, state, eye, ["plan", "follow"])}`);
        } catch {
          // The page is shown where addresses cannot be changed.
        }
      }, 400);
    },
  };
}
