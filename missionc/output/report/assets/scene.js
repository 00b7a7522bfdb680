// The map on the page, with the buttons above and below it.
function scene(model, state, change, other) {
  const view = mapView(document.getElementById("map"), model);
  // The second map of two that stand side by side looks through the same camera.
  const beside = other ? mapView(document.getElementById("map2"), other, view.camera) : null;
  for (const each of beside ? [view, beside] : [view]) gestures(each, state, change);

  const shown = () => (state.compare === "side" || state.compare === "skin" || !other ? state.compare : "");
  function draw(palette) {
    const side = Boolean(beside) && state.compare === "side";
    if (beside) beside.canvas.hidden = !side;
    view.draw(palette, state, shown() === "skin" && other ? other : null);
    if (side) beside.draw(palette, { ...state, shown: null });
    canvasesNamed(state, other);
  }

  // The whole picture on another context: of two that stand side by side both.
  function paint(context, width, height, palette) {
    if (!beside || state.compare !== "side") return view.paint(context, width, height, palette, state, other && state.compare === "skin" ? other : null);
    [view, beside].forEach((each, number) => {
      context.save();
      context.translate((number * width) / 2, 0);
      polygon(context, [[0, 0], [width / 2, 0], [width / 2, height], [0, height]]);
      context.clip();
      each.paint(context, width / 2, height, palette, number ? { ...state, shown: null } : state);
      context.restore();
    });
  }

  // Of both maps, where two stand side by side.
  const size = () => (beside && state.compare === "side" ? [2 * view.size()[0], view.size()[1]] : view.size());

  const button = (id, act) => {
    const found = document.getElementById(id);
    found.addEventListener("click", act);
    return found;
  };
  const zoomed = (times) => () => {
    view.camera.zoom(...view.size(), times);
    change({ looked: true });
  };
  button("closer", zoomed(1.4));
  button("further", zoomed(1 / 1.4));
  button("fit", () => {
    view.camera.fit();
    change({ followed: -1, looked: true });
  });
  const slant = button("slant", () => {
    view.camera.slant(!view.camera.slanted());
    change({ followed: -1, looked: true });
  });
  const measure = button("measure", () => change({ measuring: !state.measuring, ruler: null }));
  const follow = button("follow", () => change({ followed: state.followed >= 0 ? -1 : state.focus >= 0 ? state.focus : 0, ...(state.focus < 0 && state.followed < 0 ? { focus: 0 } : {}) }));

  const controls = describeLayers(model, state, change, other);
  describeAgents(model, state, change);

  function update() {
    slant.setAttribute("aria-pressed", String(view.camera.slanted()));
    measure.setAttribute("aria-pressed", String(state.measuring));
    follow.setAttribute("aria-pressed", String(state.followed >= 0));
    const name = state.followed >= 0 ? model.data.agents[state.followed].name : "";
    follow.title = name ? `Following ${name} (F)` : "Follow the selected agent (F)";
    controls();
  }

  return { draw, paint, size, update, view };
}

function canvasesNamed(state, other) {
  const tags = document.getElementById("tags");
  tags.hidden = !other;
  if (!other || tags.dataset.shown === state.compare) return;
  tags.dataset.shown = state.compare;
  tags.replaceChildren(...(state.compare === "side" ? ["A", "B"] : ["A filled, B hollow"]).map((text) => Object.assign(document.createElement("span"), { textContent: text })));
  tags.className = state.compare;
}

// What is drawn: each control is written once, and told again when the state was changed elsewhere.
function describeLayers(model, state, change, other) {
  const group = document.getElementById("layers");
  const updates = [];
  const labelled = (words, control) => {
    const item = document.createElement("label");
    item.append(...(control.type === "checkbox" ? [control, words] : [words, control]));
    group.append(item);
  };
  const box = (name, words) => {
    const input = Object.assign(document.createElement("input"), { type: "checkbox" });
    input.addEventListener("change", () => change({ layers: { ...state.layers, [name]: input.checked } }));
    updates.push(() => (input.checked = state.layers[name]));
    labelled(words, input);
  };
  const choice = (words, options, read, set) => {
    const select = document.createElement("select");
    for (const [value, text] of options) select.append(new Option(text, value));
    select.addEventListener("change", () => set(select.value));
    updates.push(() => (select.value = read()));
    labelled(words, select);
  };
  box("paths", "paths");
  box("names", "names");
  const lengths = [0, 0.02, 0.05, 0.1, 0.25, 0.5].map((share) => Number((share * model.horizon).toPrecision(2)));
  const trails = [...new Set(lengths)].map((length) => [length, length ? `${tidy(length)} s` : "none"]);
  choice("trail ", [...trails, [model.horizon, "all"]], () => trailNow(state, [...lengths, model.horizon]), (trail) => change({ trail: Number(trail) }));
  if (Object.keys(model.motions).length > 1) {
    choice("motion ", ["planned", "flown", "told", "simulated"].filter((name) => model.motions[name]).map((name) => [name, motionName(name)]), () => state.motion, (motion) => change({ motion }));
  }
  if (model.graphs.length) choice("graph ", [...model.graphs.map((graph) => [graph.name, graph.name]), ["", "none"]], () => state.graph, (graph) => change({ graph }));
  if (other) choice("compare ", [["side", "side by side"], ["skin", "onion skin"]], () => state.compare, (compare) => change({ compare }));
  return () => updates.forEach((update) => update());
}

const trailNow = (state, lengths) => lengths.reduce((best, each) => (Math.abs(each - state.trail) < Math.abs(best - state.trail) ? each : best));

// A button for each agent, with its colour and mark; pressed, it is the one that the lanes speak of.
function describeAgents(model, state, change) {
  const list = document.getElementById("agents");
  model.data.agents.forEach((agent, index) => {
    const item = document.createElement("li");
    const button = document.createElement("button");
    button.type = "button";
    button.dataset.agent = index;
    button.setAttribute("aria-pressed", "false");
    button.append(markIcon(markOf(model.style[index]), "currentColor"), agent.name);
    button.addEventListener("click", () => change({ focus: state.focus === index ? -1 : index, ...(state.followed >= 0 ? { followed: state.focus === index ? -1 : index } : {}) }));
    button.addEventListener("pointerenter", () => change({ pointed: index }));
    button.addEventListener("pointerleave", () => change({ pointed: -1 }));
    item.append(button);
    list.append(item);
  });
}
