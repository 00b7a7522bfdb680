// The canvas of the world: its view, what is drawn on it, and whom the pointer is on.
function scene(model, state, change) {
  const canvas = document.getElementById("map");
  const view = model.dimension === 3 ? volumeView(model) : planView(model);
  let points = [];
  let dragged = null;

  function draw(palette) {
    const ratio = window.devicePixelRatio || 1;
    const { clientWidth: width, clientHeight: height } = canvas;
    if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
      canvas.width = Math.round(width * ratio);
      canvas.height = Math.round(height * ratio);
    }
    const context = canvas.getContext("2d");
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.fillStyle = palette.paper;
    context.fillRect(0, 0, width, height);
    points = view.draw(context, width, height, ratio, palette, state);
  }

  function nearest(event) {
    const box = canvas.getBoundingClientRect();
    let [best, least] = [-1, 18];
    points.forEach(([x, y], agent) => {
      const distance = Math.hypot(event.clientX - box.left - x, event.clientY - box.top - y);
      if (distance < least) [best, least] = [agent, distance];
    });
    return best;
  }

  canvas.addEventListener("pointerdown", (event) => {
    dragged = { x: event.clientX, y: event.clientY, moved: false };
    canvas.setPointerCapture(event.pointerId);
  });
  canvas.addEventListener("pointermove", (event) => {
    if (!dragged) {
      canvas.style.cursor = nearest(event) >= 0 ? "pointer" : model.dimension === 3 ? "grab" : "default";
      return;
    }
    const [across, up] = [event.clientX - dragged.x, event.clientY - dragged.y];
    if (!dragged.moved && Math.hypot(across, up) < 4) return;
    view.turn(-across * 0.01, up * 0.01);
    dragged = { x: event.clientX, y: event.clientY, moved: true };
    change();
  });
  canvas.addEventListener("pointerup", (event) => {
    if (dragged && !dragged.moved) {
      const agent = nearest(event);
      change({ focus: agent === state.focus ? -1 : agent });
    }
    dragged = null;
  });
  canvas.addEventListener(
    "wheel",
    (event) => {
      if (model.dimension < 3) return;
      event.preventDefault();
      view.zoom(Math.exp(-event.deltaY * 0.001));
      change();
    },
    { passive: false },
  );
  canvas.addEventListener("keydown", (event) => {
    const turns = { a: [0.1, 0], d: [-0.1, 0], w: [0, 0.1], s: [0, -0.1] };
    if (turns[event.key]) view.turn(...turns[event.key]);
    else if (event.key === "+" || event.key === "-") view.zoom(event.key === "+" ? 1.15 : 1 / 1.15);
    else return;
    change();
  });

  describeLayers(model, state, change);
  describeAgents(model, state, change);
  return { draw, turn: view.turn };
}

function describeLayers(model, state, change) {
  const group = document.getElementById("layers");
  const box = (name, words) => {
    const item = document.createElement("label");
    const input = document.createElement("input");
    input.type = "checkbox";
    input.checked = state.layers[name];
    input.addEventListener("change", () => change({ layers: { ...state.layers, [name]: input.checked } }));
    item.append(input, words);
    group.append(item);
  };
  const choice = (words, options, chosen, set) => {
    const item = document.createElement("label");
    const select = document.createElement("select");
    for (const [value, text] of options) select.append(new Option(text, value, false, value === chosen));
    select.addEventListener("change", () => set(select.value));
    item.append(words, select);
    group.append(item);
  };
  box("paths", "paths");
  box("trails", "trails");
  box("names", "names");
  if (model.dimension === 3) box("turning", "turning");
  if (model.motions.flown) {
    choice("motion ", ["planned", "flown", "simulated"].filter((name) => model.motions[name]).map((name) => [name, name]), state.follow, (follow) => change({ follow }));
  }
  if (model.graphs.length) {
    const options = [...model.graphs.map((graph) => [graph.name, graph.name]), ["", "none"]];
    choice("graph ", options, state.graph, (graph) => change({ graph }));
  }
}

// A button for each agent, in its colour; pressed, it is the one that the lanes speak of.
function describeAgents(model, state, change) {
  const list = document.getElementById("agents");
  model.data.agents.forEach((agent, index) => {
    const item = document.createElement("li");
    const button = document.createElement("button");
    button.type = "button";
    button.dataset.agent = index;
    button.setAttribute("aria-pressed", "false");
    const dot = document.createElement("span");
    dot.className = "dot";
    button.append(dot, agent.name);
    button.addEventListener("click", () => change({ focus: state.focus === index ? -1 : index }));
    item.append(button);
    list.append(item);
  });
}
