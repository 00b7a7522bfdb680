// One stream of messages; each brings what is new, the first one everything.
function flightPage(first) {
  const model = flightModel(first.world, first.plan);
  const state = shownOfFlight(model);
  const byId = (id) => document.getElementById(id);
  let [asked, stale, grown, telling] = [false, true, true, true];

  function change(changes = {}) {
    if ("time" in changes) state.live = false;
    if ("theme" in changes || "focus" in changes || changes.layout) stale = true;
    telling = true;
    Object.assign(state, changes);
    delete state.layout;
    again();
  }

  function again() {
    if (asked) return;
    asked = true;
    requestAnimationFrame(frame);
  }

  const palette = () => (state.theme === "dark" ? DARK : LIGHT);

  function frame() {
    asked = false;
    if (state.live && model.now) state.time = model.now.t;
    if (stale) {
      document.documentElement.dataset.theme = state.theme;
      for (const button of document.querySelectorAll("#agents button")) {
        button.setAttribute("aria-pressed", String(Number(button.dataset.agent) === state.focus));
        button.firstChild.style.color = colourOf(palette(), model.style[Number(button.dataset.agent)]);
      }
    }
    if (stale || grown) lanes.draw(palette());
    lanes.update();
    map.draw(palette());
    if (state.live) paintDoubt();
    clock();
    if (telling) {
      map.update();
      // Without a plan there are no paths to be drawn.
      byId("layers").firstChild.hidden = !model.motions.planned;
      bar.later();
    }
    [stale, grown, telling] = [false, false, false];
  }

  // Of an agent that is missing, how far it may have got from where it was seen last.
  function paintDoubt() {
    if (!model.now) return;
    const context = byId("map").getContext("2d");
    const { scale } = map.view.camera.frame(...map.view.size());
    for (const agent of model.now.missing) {
      if (!model.now.place[agent]) continue;
      context.strokeStyle = palette().harms;
      context.lineWidth = 1.5;
      context.setLineDash([5, 4]);
      for (const radius of [12, model.now.doubt[agent] * scale]) {
        circle(context, ...map.view.pointOf(model.placeAt(model.motions.seen, agent, state.time)), radius);
        context.stroke();
      }
      context.setLineDash([]);
    }
  }

  function clock() {
    byId("live").setAttribute("aria-pressed", String(state.live));
    const said = model.now ? `${state.time.toFixed(2)} s of ${tidy(model.data.lasts)} s${state.live ? "" : " · past"}` : "waiting for samples";
    if (byId("clock").textContent !== said) byId("clock").textContent = said;
  }

  const view = fragment();
  readAddress(model, state, view, { set: (camera) => (state.looked = camera) });
  Object.assign(state, { playing: false, live: true, motion: "seen" });
  const map = scene(model, state, change, null);
  if (state.looked) map.view.camera.set(state.looked);
  const bar = addressBar(model, state, map.view.camera);
  const lanes = flightLanes(model, state, change);
  const status = flightStatus(model);
  ticks(model);
  splitters(change);
  fullScreen(state, change);
  byId("theme").addEventListener("click", () => change({ theme: state.theme === "dark" ? "light" : "dark" }));
  byId("live").addEventListener("click", () => {
    state.live = true;
    change();
  });
  new ResizeObserver(() => change({ layout: true })).observe(document.querySelector("main"));

  let { world } = first;
  return (message) => {
    if (message !== first && ("world" in message || "plan" in message)) {
      world = message.world ?? world;
      flightModel(world, message.plan, model);
      map.view.setWorld(model);
      lanes.build();
      [stale, telling] = [true, true];
    }
    model.take(message);
    status(message);
    grown ||= message.columns.count > 0;
    again();
  };
}

let page = null;
const stream = new EventSource("news");
stream.onmessage = (event) => {
  const message = JSON.parse(event.data);
  page ??= flightPage(message);
  page(message);
};
stream.onerror = () => {
  const said = document.getElementById("stream");
  said.className = "bad";
  said.textContent = "■ missionc has ended; last state received";
};
