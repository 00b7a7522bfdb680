// Pixels between two numbers below the bar.
const ROOM_OF_TICK = 4;

// Time: what moves it on, and the keys.
function player(model, state, change) {
  const range = document.getElementById("now");
  const play = document.getElementById("play");
  const clock = document.getElementById("clock");
  const speed = document.getElementById("speed");
  const { step } = model.data;
  range.max = model.horizon;
  for (const each of SPEEDS) speed.append(new Option(`${each}×`, each, false, each === state.speed));
  const stepBy = (steps) => change({ time: model.within((Math.round(state.time / step) + steps) * step), playing: false });
  const toggle = () => change({ playing: !state.playing, ...(state.playing || state.time < model.horizon - 1e-9 ? {} : { time: 0 }) });

  play.addEventListener("click", toggle);
  document.getElementById("back").addEventListener("click", () => stepBy(-1));
  document.getElementById("ahead").addEventListener("click", () => stepBy(1));
  speed.addEventListener("change", () => change({ speed: Number(speed.value) }));
  range.addEventListener("input", () => change({ time: Number(range.value), playing: false }));
  marks(model, change);
  ticks(model);

  window.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const tag = event.target.tagName;
    if (tag === "INPUT" && event.target.type === "text") return;
    const many = event.shiftKey ? 10 : 1;
    const act = {
      " ": tag === "BUTTON" || tag === "SELECT" || tag === "SUMMARY" || event.target.type === "checkbox" ? null : toggle,
      ArrowLeft: tag === "SELECT" ? null : () => stepBy(-many),
      ArrowRight: tag === "SELECT" ? null : () => stepBy(many),
      Home: tag === "SELECT" ? null : () => change({ time: 0, playing: false }),
      End: tag === "SELECT" ? null : () => change({ time: model.horizon, playing: false }),
      t: () => document.getElementById("theme").click(),
      f: () => document.getElementById("follow").click(),
      r: () => document.getElementById("measure").click(),
      v: () => document.getElementById("slant").click(),
      m: () => document.getElementById("wide").click(),
      "<": () => faster(-1),
      ">": () => faster(1),
    }[event.key];
    if (!act) return;
    event.preventDefault();
    act();
  });

  function faster(by) {
    const at = Math.min(SPEEDS.length - 1, Math.max(0, SPEEDS.indexOf(state.speed) + by));
    speed.value = SPEEDS[at];
    change({ speed: SPEEDS[at] });
  }

  let last = 0;
  function tick(now) {
    if (!state.playing) {
      last = 0;
      return;
    }
    const passed = last ? Math.min(now - last, 100) / 1000 : 0;
    last = now;
    const time = model.within(state.time + passed * state.speed);
    change({ time, playing: time < model.horizon - 1e-9 });
    requestAnimationFrame(tick);
  }

  let running = false;
  let told = "";
  function update() {
    range.value = state.time;
    const digits = step < 0.1 ? 2 : 1;
    const counted = flightClock(model.data, state.time, digits) || ` · step ${model.stepAt(state.time)} of ${model.data.steps}`;
    const text = `${state.time.toFixed(digits)} s${counted}`;
    if (text !== told) clock.textContent = told = text;
    if (state.playing !== running || !state.playing) {
      range.setAttribute("aria-valuetext", `${state.time.toFixed(2)} of ${model.horizon} seconds${flightClock(model.data, state.time, 2)}`);
      play.textContent = state.playing ? "❚❚" : "▶";
      play.setAttribute("aria-label", state.playing ? "Pause" : "Play");
      if (Number(speed.value) !== state.speed) speed.value = state.speed;
    }
    if (state.playing && !running) requestAnimationFrame(tick);
    running = state.playing;
  }

  return { update };
}

// Seconds below the bar; where there is no room between its neighbour and the last one, a tick is left out.
function ticks(model) {
  const bar = document.getElementById("ticks");
  const gap = pleasant(model.horizon, 10);
  const times = [];
  for (let time = 0; time < model.horizon - gap / 2; time += gap) times.push(time);
  for (const time of [...times, model.horizon]) {
    const tick = document.createElement("span");
    tick.style.left = `${(time / model.horizon) * 100}%`;
    tick.textContent = `${Number(time.toFixed(6))} s`;
    bar.append(tick);
  }
  new ResizeObserver(() => {
    const boxes = [...bar.children].map((tick) => tick.getBoundingClientRect());
    const last = boxes.length - 1;
    let free = -Infinity;
    boxes.forEach(({ left, right }, at) => {
      const fits = at === last || (left >= free && right <= boxes[last].left - ROOM_OF_TICK);
      bar.children[at].style.visibility = fits ? "" : "hidden";
      if (fits) free = right + ROOM_OF_TICK;
    });
  }).observe(bar);
}

// Where margins are tight: a mark for each, the tightest larger; and where something happened to a flight.
function marks(model, change) {
  const bar = document.getElementById("marks");
  for (const { t, by, says } of model.data.loop?.flights[0].told ?? []) {
    if (by === "nearest") continue;
    const button = Object.assign(document.createElement("button"), { type: "button", className: by, title: `${Number(t.toFixed(2))} s: ${says.replaceAll("`", "")}` });
    button.style.left = `${Math.min(100, (t / model.horizon) * 100)}%`;
    button.setAttribute("aria-label", button.title);
    button.addEventListener("click", () => change({ time: t, playing: false }));
    bar.append(button);
  }
  const broken = model.data.between.filter((each) => each.verdict === "fails between");
  const between = broken.map((each) => ({ name: "continuous time, requirement", subject: each.requirement, at: each.at, margin: null, unit: "m", passed: false }));
  for (const check of [...model.data.checks, ...between]) {
    if (check.at === null || (check.unit !== "m" && check.passed)) continue;
    const button = document.createElement("button");
    button.type = "button";
    button.className = check.passed ? (check.tightest ? "tightest" : "") : "failed";
    button.style.left = `${Math.min(100, Math.max(0, (check.at / model.horizon) * 100))}%`;
    const margin = check.margin === null ? "" : `: ${marginText(check)}`;
    button.title = `${check.tightest ? "smallest margin: " : ""}${checkName(check.name)}${check.name.endsWith("requirement") ? ` ${check.subject}` : ""}${margin} at ${Number(check.at.toFixed(2))} s`;
    button.setAttribute("aria-label", button.title);
    button.tabIndex = check.tightest || !check.passed ? 0 : -1;
    button.addEventListener("click", () => change({ time: check.at, playing: false }));
    bar.append(button);
  }
}
