// What moves: obstacles, trails, links, formations, agents.

// How an edge of a formation stands.
const STANDING = { kept: 0, risk: 1, broken: 2 };

// Which links, routes and formations are there at a step, and who is lit; kept for as long as the step is the same.
function happenings(model) {
  let known = { key: "" };
  return (state) => {
    const step = model.stepAt(state.time);
    // Of a flight that goes on, more is known of the present: which links are broken or at risk.
    const present = model.couplingsAt?.(state.time);
    const key = [step, state.shown, state.graph, present ? model.stamp : ""].join();
    if (key === known.key) return known;
    const row = state.shown === null ? null : model.lanes[state.shown].values;
    const graph = model.graphs.find((each) => each.name === state.graph);
    const current = graph && present && present.graphs[graph.name];
    const links = [];
    if (graph) graph.links.at(step, (first, second, kind) => links.push({ first, second, kind }));
    if (current) links.splice(0, Infinity, ...asItIsNow(links, current.linked));
    if (graph && graph.directed) {
      const there = new Set(links.filter((link) => ["there", "new"].includes(link.kind)).map((link) => `${link.first} ${link.second}`));
      for (const link of links) link.oneWay = !there.has(`${link.second} ${link.first}`);
    }
    for (const kind of current ? ["risk", "broken"] : []) for (const [first, second] of current[kind]) links.push({ first, second, kind });
    const route = [];
    if (row && row.links) row.links.at(step, (first, second, kind) => kind !== "gone" && route.push([first, second]));
    const lit = (agent) => (row && row.lit ? row.lit[agent * model.states + step] : 0);
    const edges = [];
    for (const formation of model.formations) {
      const shown = Boolean(row && row.formations.includes(formation.name));
      formation.edges.forEach(([first, second], edge) => {
        const stands = present ? present.formations[formation.name][edge] : formation.margins[edge * model.states + step] >= 0 ? STANDING.kept : STANDING.broken;
        edges.push({ first, second, shown: shown || Boolean(present && stands !== STANDING.kept), name: edge ? "" : formation.name, stands });
      });
    }
    known = { key, step, links, route, lit, edges };
    return known;
  };
}

// The links of a step that goes on: those that there are by now; what was there at its beginning and is not is gone.
function asItIsNow(links, linked) {
  const kinds = new Map(links.map((link) => [`${link.first} ${link.second}`, link.kind]));
  const now = linked.map(([first, second]) => ({ first, second, kind: kinds.get(`${first} ${second}`) === "new" ? "new" : "there" }));
  const there = new Set(linked.map(([first, second]) => `${first} ${second}`));
  return [...now, ...links.filter((link) => !there.has(`${link.first} ${link.second}`)).map((link) => ({ ...link, kind: "gone" }))];
}

// Where an obstacle goes.
function paintTrack(context, frame, model, palette, obstacle) {
  context.setLineDash([4, 3]);
  context.strokeStyle = palette.obstacle;
  context.lineWidth = 1;
  context.beginPath();
  [0, ...obstacle.path.times.filter((each) => each > 0 && each < model.horizon), model.horizon].forEach((time, at) => {
    const shift = model.shiftAt(obstacle, time);
    context[at ? "lineTo" : "moveTo"](...frame.point([obstacle.inner[0] + shift[0], obstacle.inner[1] + shift[1], shift[2]]));
  });
  context.stroke();
  context.setLineDash([]);
}

// What moves, grows, or is not there all the time.
function paintObstacles(context, frame, model, palette, time) {
  for (const shape of [...model.data.regions, ...model.data.obstacles]) {
    if (isStill(shape) || !isThere(shape, time)) continue;
    if (shape.path) paintTrack(context, frame, model, palette, shape);
    const look = lookOf(palette, shape, !frame.flat && model.dimension === 3);
    paintShape(context, shape, model.shiftAt(shape, time), frame, look, shape.growth ? model.grownAt(shape, time) : 0);
  }
}

function paintTrails(context, frame, model, palette, state, places, ghost) {
  const motion = model.motions[state.motion] || model.motions.planned;
  const now = Math.min((state.time / model.data.step) * motion.rate, motion.samples - 1);
  const first = Math.max(0, Math.ceil(((state.time - state.trail) / model.data.step) * motion.rate));
  context.lineCap = "round";
  context.setLineDash(ghost ? [3, 4] : []);
  for (let agent = 0; agent < model.agents; agent++) {
    context.strokeStyle = colourOf(palette, model.style[agent]);
    context.globalAlpha = state.focus >= 0 && state.focus !== agent ? 0.2 : ghost ? 0.6 : model.crowd ? 0.6 : 0.9;
    context.lineWidth = model.crowd ? 1.4 : 2.4;
    context.beginPath();
    trace(context, frame, model, motion, agent, first, Math.floor(now));
    if (Math.floor(now) < first) context.moveTo(...places[agent]);
    context.lineTo(...places[agent]);
    context.stroke();
  }
  context.setLineDash([]);
  context.globalAlpha = 1;
}

// Links as they are, thicker at the step they appear, dashed at the step they break, with an arrowhead where they lead
// one way; those that are at risk or broken now; the formations, and the lit route above all. What is drawn alike is one
// path.
function paintLinks(context, points, happening, palette) {
  const kinds = [["there", 1.2, [], 0.75, palette.link], ["new", 2.6, [], 0.75, palette.link], ["gone", 1.2, [2, 5], 0.5, palette.link], ["risk", 2.6, [], 1, palette.between], ["broken", 2.2, [6, 4], 1, palette.harms]];
  for (const [kind, wide, dash, alpha, strokeStyle] of kinds) {
    context.beginPath();
    for (const link of happening.links) {
      if (link.kind !== kind) continue;
      context.moveTo(...points[link.first]);
      context.lineTo(...points[link.second]);
    }
    Object.assign(context, { strokeStyle, lineWidth: wide, globalAlpha: alpha });
    context.setLineDash(dash);
    context.stroke();
  }
  context.setLineDash([]);
  for (const link of happening.links) if (link.oneWay && ["there", "new"].includes(link.kind)) arrowhead(context, points[link.first], points[link.second], palette.link);
  context.globalAlpha = 1;
  for (const edge of happening.edges) {
    const strokeStyle = [palette.helps, palette.between, edge.shown ? palette.harms : palette.faint][edge.stands];
    Object.assign(context, { strokeStyle, lineWidth: edge.shown ? 3 : 1.4, globalAlpha: edge.shown ? 1 : 0.6 });
    context.setLineDash(edge.stands === STANDING.broken ? [6, 4] : []);
    line(context, ...points[edge.first], ...points[edge.second]);
  }
  context.setLineDash([]);
  context.globalAlpha = 1;
  for (const [colour, wide] of [[palette.floor, 7], [palette.helps, 4]]) {
    Object.assign(context, { strokeStyle: colour, lineWidth: wide });
    context.beginPath();
    for (const [first, second] of happening.route) {
      context.moveTo(...points[first]);
      context.lineTo(...points[second]);
    }
    context.stroke();
  }
}

// The body at its size, and the mark, which is never too small to be seen.
function paintAgent(context, [x, y], agent, frame, model, palette, state, lit, ghost) {
  const colour = colourOf(palette, model.style[agent]);
  const gone = state.motion === "simulated" && state.time >= model.goneAt[agent];
  const dim = gone || (state.focus >= 0 && state.focus !== agent);
  const body = model.data.agents[agent].radius * frame.scale;
  const size = Math.max(Math.min(body, 9), model.crowd ? 3.2 : 5);
  if (body > size + 1) {
    context.globalAlpha = dim ? 0.15 : 0.3;
    context.fillStyle = colour;
    circle(context, x, y, body);
    context.fill();
  }
  if (lit) {
    context.globalAlpha = dim ? 0.45 : 1;
    context.strokeStyle = lit === 1 ? palette.helps : palette.harms;
    context.lineWidth = 3;
    context.setLineDash(lit === 1 ? [] : [4, 3]);
    circle(context, x, y, Math.max(size, body) + 5);
    context.stroke();
    context.setLineDash([]);
  }
  context.globalAlpha = dim ? 0.35 : ghost ? 0.55 : 0.95;
  mark(context, markOf(model.style[agent]), x, y, size);
  context.fillStyle = ghost ? palette.floor : colour;
  context.fill();
  context.globalAlpha = dim ? 0.5 : 1;
  const chosen = state.focus === agent || state.pointed === agent;
  context.lineWidth = chosen ? 2.5 : 1.2;
  context.strokeStyle = ghost ? colour : chosen ? palette.ink : palette.floor;
  context.stroke();
  context.globalAlpha = 1;
  // Its motors have stopped.
  if (gone) cross(context, x, y, palette.harms);
}
