// The lanes and charts below each other on one axis of time, and what they say at the moment.
function timeline(model, state, change, words) {
  const list = document.getElementById("lanes");
  const head = document.getElementById("head");
  const entries = [];

  model.data.lanes.forEach((lane, index) => {
    const row = model.rows[lane.row];
    const item = document.createElement("div");
    item.className = lane.depth ? "lane" : "lane goal";
    item.setAttribute("role", "option");
    item.setAttribute("aria-selected", "false");
    item.tabIndex = index ? -1 : 0;
    item.dataset.lane = index;
    const label = document.createElement("div");
    label.className = "label";
    label.style.paddingLeft = `${8 + Math.min(lane.depth, 12) * 12}px`;
    if (lane.name) {
      const name = document.createElement("b");
      name.textContent = lane.weight === null ? lane.name : `${lane.name} (preferred)`;
      label.append(name, " ");
    }
    if (lane.let) {
      const name = document.createElement("i");
      name.textContent = lane.let;
      label.append(name, " ");
    }
    const text = document.createElement("code");
    text.textContent = lane.words;
    text.title = lane.words;
    const value = document.createElement("output");
    label.append(text, value);
    const canvas = document.createElement("canvas");
    canvas.style.height = `${row.team ? ROOM.team : ROOM.agents}px`;
    canvas.setAttribute("aria-hidden", "true");
    item.append(label, canvas);
    list.append(item);
    const entry = { item, canvas, value, row, lane, draw: (palette) => drawLane(canvas, row, model, state, palette) };
    entries.push(entry);
    item.addEventListener("pointerenter", () => change({ hovered: index }));
    item.addEventListener("pointerleave", () => change({ hovered: null }));
    item.addEventListener("focus", () => change({ hovered: index }));
    item.addEventListener("blur", () => change({ hovered: null }));
    item.addEventListener("click", () => select(index));
    item.addEventListener("keydown", (event) => {
      const next = { ArrowDown: index + 1, ArrowUp: index - 1 }[event.key];
      if (event.key === "Enter") select(index);
      else if (event.key === "Escape") change({ selected: null });
      else if (next !== undefined && entries[next] && entries[next].lane) {
        item.tabIndex = -1;
        entries[next].item.tabIndex = 0;
        entries[next].item.focus();
      } else return;
      event.preventDefault();
      event.stopPropagation();
    });
    drag(canvas, model, change);
  });

  for (const chart of model.charts) {
    const item = document.createElement("div");
    item.className = "lane chart";
    const label = document.createElement("div");
    label.className = "label";
    const name = document.createElement("b");
    name.textContent = chart.name;
    const limits = document.createElement("small");
    const many = new Set(chart.series.map((each) => each.team)).size > 1;
    const most = chart.low ? "at least" : "at most";
    limits.textContent = chart.limits.length
      ? chart.limits.map((limit) => `${most} ${short(limit.value)} ${chart.unit} (${limit.by}${many && limit.team ? ` of ${limit.team}` : ""})`).join(", ")
      : "no limit";
    const value = document.createElement("output");
    label.append(name, limits, value);
    const canvas = document.createElement("canvas");
    canvas.style.height = `${ROOM.chart}px`;
    canvas.setAttribute("role", "img");
    canvas.setAttribute("aria-label", `${chart.name} over time, ${limits.textContent}`);
    item.append(label, canvas);
    entries.push({ item, canvas, value, chart, many, draw: (palette) => drawChart(canvas, chart, model, palette) });
    drag(canvas, model, change);
  }
  const charts = entries.filter((entry) => entry.chart);
  list.after(...charts.map((entry) => entry.item));

  function select(index) {
    change({ selected: state.selected === index ? null : index });
    if (state.selected === index) words.show(model.data.lanes[index].place);
    else words.show(null);
  }

  function draw(palette) {
    for (const entry of entries) entry.draw(palette);
  }

  // Values at the moment; cheap enough for every frame.
  function update() {
    const step = model.stepAt(state.time);
    const first = entries.length ? entries[0].canvas : null;
    if (first) head.style.left = `${first.offsetLeft + (state.time / model.horizon) * first.clientWidth}px`;
    entries.forEach((entry, index) => {
      if (entry.chart) {
        entry.value.textContent = entry.chart.series.map((each) => `${each.motion}${each.team && entry.many ? ` ${each.team}` : ""} ${short(each.values[Math.round((state.time / model.horizon) * (each.values.length - 1))])}`).join(" · ");
        return;
      }
      const said = told(entry.row, step);
      entry.value.textContent = said.text;
      entry.item.dataset.state = said.state;
      const selected = String(state.selected === index);
      if (entry.item.getAttribute("aria-selected") !== selected) entry.item.setAttribute("aria-selected", selected);
    });
  }

  function told(row, step) {
    const one = row.team ? 0 : state.focus;
    if (one >= 0) {
      const index = one * model.states + step;
      if (!row.verdict && !row.asked[index]) return { text: "not asked", state: "none" };
      const name = stateOf(row, index);
      if (!row.verdict || row.least[index] === row.most[index]) return { text: `${mark(name)} ${short(row.least[index])}`, state: name };
      const parts = [Number.isFinite(row.least[index]) ? `≥ ${short(row.least[index])}` : "", Number.isFinite(row.most[index]) ? `≤ ${short(row.most[index])}` : ""];
      return { text: `${mark(name)} ${parts.join(" ").trim()}`.trim(), state: name };
    }
    const counts = { holds: 0, open: 0, fails: 0 };
    for (let agent = 0; agent < row.count; agent++) {
      const index = agent * model.states + step;
      if (row.verdict || row.asked[index]) counts[stateOf(row, index)]++;
    }
    const all = counts.holds + counts.open + counts.fails;
    if (!all) return { text: "not asked", state: "none" };
    const whole = counts.fails ? "fails" : counts.open ? "open" : "holds";
    const good = whole === "open" ? counts.open : all - counts.fails;
    return { text: `${mark(whole)} ${good} of ${all}`, state: whole };
  }

  return { draw, update, select };
}

const mark = (state) => ({ holds: "✓", fails: "✗", open: "…" })[state];

// A press or a drag on a track goes to that time.
function drag(canvas, model, change) {
  const go = (event) => {
    const box = canvas.getBoundingClientRect();
    const share = Math.min(1, Math.max(0, (event.clientX - box.left) / box.width));
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
