// The lanes below each other on one axis of time: a row for each requirement, which unfolds to its parts; then charts.
function timeline(model, state, change, words, other) {
  const list = document.getElementById("lanes");
  const head = document.getElementById("head");
  const entries = [];
  const unfolded = new Set();

  model.lanes.forEach((lane, index) => {
    const entry = laneRow(lane, model, other);
    const { item, canvas } = entry;
    entries.push({ ...entry, lane, stale: true, draw: (palette) => drawLane(canvas, lane, model, state, palette), now: (step) => told(lane, step) });
    list.append(item);
    item.addEventListener("pointerenter", () => change({ hovered: index }));
    item.addEventListener("pointerleave", () => change({ hovered: null }));
    item.addEventListener("focus", () => change({ hovered: index }));
    item.addEventListener("blur", () => change({ hovered: null }));
    item.addEventListener("click", (event) => event.target !== canvas && select(index));
    if (entry.toggle) {
      entry.toggle.addEventListener("click", (event) => {
        event.stopPropagation();
        fold(index, !unfolded.has(index));
      });
    }
    if (entry.when) {
      entry.when.addEventListener("click", (event) => {
        event.stopPropagation();
        change({ time: lane.decided.step * model.data.step, playing: false });
      });
    }
    item.addEventListener("keydown", (event) => event.target === item && key(event, index));
    drag(canvas, model, change);
  });

  for (const chart of model.charts) {
    const entry = chartRow(chart);
    entries.push({ ...entry, stale: true, draw: (palette) => drawChart(entry.canvas, chart, model, palette), now: () => ({ text: chartNow(chart, model, state.time) }) });
    drag(entry.canvas, model, change);
  }
  list.after(...entries.filter((entry) => !entry.lane).map((entry) => entry.item));

  function key(event, index) {
    const shown = entries.filter((entry) => entry.lane && !entry.item.hidden).map((entry) => entry.lane.index);
    const at = shown.indexOf(index);
    const next = { ArrowDown: shown[at + 1], ArrowUp: shown[at - 1] }[event.key];
    const lane = model.lanes[index];
    if (event.key === "Enter") select(index);
    else if (event.key === "Escape") change({ selected: null });
    else if (event.key === "ArrowRight" && lane.folds && !unfolded.has(index)) fold(index, true);
    else if (event.key === "ArrowLeft" && lane.folds && unfolded.has(index)) fold(index, false);
    else if (next !== undefined) {
      entries[index].item.tabIndex = -1;
      entries[next].item.tabIndex = 0;
      entries[next].item.focus();
    } else return;
    event.preventDefault();
    event.stopPropagation();
  }

  // Who is folded hides what is below it, also of what is unfolded there.
  function fold(index, open) {
    unfolded[open ? "add" : "delete"](index);
    const path = [];
    for (const entry of entries) {
      if (!entry.lane) continue;
      path.length = entry.lane.depth;
      entry.item.hidden = path.some((shown) => !shown);
      path[entry.lane.depth] = unfolded.has(entry.lane.index);
      if (entry.lane.folds) {
        entry.item.setAttribute("aria-expanded", String(path[entry.lane.depth]));
        entry.toggle.setAttribute("aria-label", `${path[entry.lane.depth] ? "Fold" : "Unfold"} ${entry.lane.name || entry.lane.words}`);
        entry.toggle.textContent = path[entry.lane.depth] ? "▾" : "▸";
      }
    }
    stretch();
    change({ layout: true });
  }
  const stretch = () => entries.forEach((entry) => (entry.stale = true));

  // Also those above it unfold.
  function reveal(index) {
    for (let depth = model.lanes[index].depth, at = index; depth > 0; at--) {
      if (model.lanes[at].depth < depth) {
        unfolded.add(at);
        depth = model.lanes[at].depth;
      }
    }
    fold(index, unfolded.has(index));
    entries[index].item.scrollIntoView({ block: "nearest" });
  }

  function select(index) {
    change({ selected: state.selected === index ? null : index });
    if (state.selected !== null) reveal(index);
    words.show(state.selected === index ? model.data.lanes[index].place : null);
  }

  // Those that are seen are drawn; the others when they are unfolded.
  function draw(palette, all) {
    if (all) stretch();
    for (const entry of entries) {
      if (!entry.stale || entry.item.hidden) continue;
      entry.draw(palette);
      entry.stale = false;
    }
  }

  let axis = null;
  const measured = () => {
    const first = entries.find((entry) => !entry.item.hidden);
    axis = first ? [first.canvas.offsetLeft + GUTTER, first.canvas.clientWidth - GUTTER] : null;
  };

  // What they say at the moment: what has changed alone is written, which no frame has to wait for.
  let before = "";
  function update() {
    if (axis) head.style.transform = `translateX(${axis[0] + (state.time / model.horizon) * axis[1]}px)`;
    const step = model.stepAt(state.time);
    const chosen = [step, state.focus, state.selected, [...unfolded]].join();
    const still = !state.playing || chosen !== before;
    before = chosen;
    if (!still) return;
    for (const entry of entries) {
      if (entry.item.hidden) continue;
      const said = entry.now(step);
      if (entry.said !== said.text) entry.value.textContent = entry.said = said.text;
      if (!entry.lane) continue;
      if (entry.item.dataset.state !== said.state) entry.item.dataset.state = said.state;
      const selected = String(state.selected === entry.lane.index);
      if (entry.item.getAttribute("aria-selected") !== selected) entry.item.setAttribute("aria-selected", selected);
    }
  }

  // Of one agent its robustness; of several how many of those that are asked do what.
  function told(lane, step) {
    const row = lane.values;
    const one = row.team ? 0 : state.focus;
    if (one >= 0) {
      const index = one * model.states + step;
      const name = EFFECTS[lane.effect[index]];
      if (name === "absent") return { text: "not evaluated", state: "absent" };
      const sign = name === "open" ? "…" : row.surely[index] ? "✓" : "✗";
      if (!row.verdict || row.least[index] === row.most[index]) return { text: `${sign} ${short(row.least[index])}`, state: name };
      const parts = [Number.isFinite(row.least[index]) ? `≥ ${short(row.least[index])}` : "", Number.isFinite(row.most[index]) ? `≤ ${short(row.most[index])}` : ""];
      return { text: `${sign} ${parts.join(" ").trim()}`.trim(), state: name };
    }
    let [asked, open, holding] = [0, 0, 0];
    for (let index = step; index < lane.effect.length; index += model.states) {
      const name = EFFECTS[lane.effect[index]];
      if (name === "absent") continue;
      asked++;
      if (name === "open") open++;
      else if (row.surely[index]) holding++;
    }
    if (!asked) return { text: "not evaluated", state: "absent" };
    const counts = countsAt(lane, model, step);
    const name = counts.harms ? "harms" : open ? "open" : counts.helps ? "helps" : "neither";
    const rest = open ? `, ${open} not decided` : "";
    return { text: open === asked ? `… ${open} not decided` : `${holding === asked ? "✓" : holding ? "◐" : "✗"} ${holding} of ${asked}${rest}`, state: name };
  }

  fold(-1, false);
  return { draw, update, select, measured, reveal };
}

// A row: who it is, what it says, and its track.
function laneRow(lane, model, other) {
  const item = document.createElement("div");
  item.className = lane.depth ? "lane" : "lane goal";
  item.setAttribute("role", "treeitem");
  item.setAttribute("aria-level", String(lane.depth + 1));
  item.setAttribute("aria-selected", "false");
  item.tabIndex = lane.index ? -1 : 0;
  item.dataset.lane = lane.index;
  const named = document.createElement("div");
  named.className = "label";
  named.style.paddingLeft = `${6 + Math.min(lane.depth, 12) * 12}px`;
  const toggle = lane.folds ? Object.assign(document.createElement("button"), { type: "button", className: "fold", textContent: "▸", tabIndex: -1 }) : null;
  named.append(toggle ?? Object.assign(document.createElement("span"), { className: "fold" }));
  const text = Object.assign(document.createElement("code"), { textContent: lane.words, title: lane.words });
  const value = document.createElement("output");
  let when = null;
  if (lane.depth === 0) {
    const name = Object.assign(document.createElement("b"), { textContent: lane.weight === null ? lane.name : `${lane.name} (preference)` });
    when = decidedButton(lane, model, "");
    const top = Object.assign(document.createElement("div"), { className: "top" });
    top.append(name, when);
    if (other) {
      const same = other.lanes.find((each) => each.depth === 0 && each.name === lane.name);
      if (same) top.append(Object.assign(document.createElement("span"), { className: `decided ${same.decided.holds ? "holds" : "fails"}`, textContent: `B ${decidedText(same, other)}` }));
      when.prepend("A ");
    }
    // Of flights in a closed loop the lane is the plan's; what came of it in the first one stands before that.
    if (model.data.loop && lane.weight === null) {
      const lost = model.data.loop.flights[0].lost.includes(lane.name);
      when.before(Object.assign(document.createElement("span"), { className: `decided ${lost ? "fails" : "holds"}`, textContent: lost ? "✗ violated in flight" : "✓ satisfied in flight" }));
      when.prepend("plan: ");
    }
    const below = Object.assign(document.createElement("div"), { className: "top" });
    below.append(text, value);
    const both = Object.assign(document.createElement("div"), { className: "both" });
    both.append(top, below);
    named.append(both);
    item.setAttribute("aria-label", `${lane.name}: ${lane.words}; ${decidedText(lane, model)}`);
  } else {
    if (lane.let) named.append(Object.assign(document.createElement("i"), { textContent: lane.let }));
    named.append(text, value);
    item.setAttribute("aria-label", lane.words);
  }
  const canvas = document.createElement("canvas");
  canvas.style.height = `${lane.depth === 0 ? ROOM.goal : lane.values.team ? ROOM.team : ROOM.agents}px`;
  canvas.setAttribute("aria-hidden", "true");
  item.append(named, canvas);
  return { item, canvas, value, toggle, when };
}

// When a requirement is decided, and by whom: at most three by name.
function decidedText({ decided }, model) {
  const by = decided.by.length === model.agents && model.agents > 1 ? "all agents" : decided.by.slice(0, 3).map((agent) => model.data.agents[agent].name).join(", ") + (decided.by.length > 3 ? ` and ${decided.by.length - 3} more` : "");
  return `${decided.holds ? "✓ satisfied" : "✗ violated"} at ${tidy(decided.step * model.data.step)} s${by ? ` by ${by}` : ""}`;
}

function decidedButton(lane, model, before) {
  const button = Object.assign(document.createElement("button"), { type: "button", tabIndex: -1, className: `decided ${lane.decided.holds ? "holds" : "fails"}`, textContent: before + decidedText(lane, model) });
  button.title = "Go to this time";
  return button;
}

function chartRow(chart) {
  const item = Object.assign(document.createElement("div"), { className: "lane chart" });
  const named = Object.assign(document.createElement("div"), { className: "label" });
  const name = Object.assign(document.createElement("b"), { textContent: chart.unit ? `${chart.name} (${chart.unit})` : chart.name });
  const limits = Object.assign(document.createElement("small"), { textContent: limitsOf(chart) });
  const value = document.createElement("output");
  named.append(name, limits, value);
  const canvas = document.createElement("canvas");
  canvas.style.height = `${ROOM.chart}px`;
  canvas.setAttribute("role", "img");
  canvas.setAttribute("aria-label", `${chart.name} over time, ${limits.textContent}`);
  item.append(named, canvas);
  return { item, canvas, value };
}

// A press or a drag on a track goes to that time.
function drag(canvas, model, change) {
  const go = (event) => {
    const box = canvas.getBoundingClientRect();
    const share = Math.min(1, Math.max(0, (event.clientX - box.left - GUTTER) / (box.width - GUTTER)));
    change({ time: share * model.horizon, playing: false });
  };
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    go(event);
  });
  canvas.addEventListener("pointermove", (event) => {
    if (canvas.hasPointerCapture(event.pointerId)) go(event);
  });
}
