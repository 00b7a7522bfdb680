// The model of a flight that goes on: the world as the report has it, and columns of time that fill.
// The same object again takes in another world or plan, and keeps what was seen.
function flightModel(world, plan, model = {}) {
  const motion = plan ? { planned: { rate: world.every, added: false, position: plan } } : {};
  const before = { ...model };
  Object.assign(model, readModel({ ...world, rows: [], lanes: [], charts: [], checks: [], between: [], motion }));
  const { agents, states, dimension } = model;
  if (plan) model.motions.planned.samples = model.motions.planned.position.length / (dimension * agents);
  const seen = before.motions?.seen ?? { rate: 1, samples: states, position: new Float32Array(dimension * agents * states).fill(NaN) };
  // Not among those that are drawn as paths: it is a trail.
  Object.defineProperty(model.motions, "seen", { value: seen });
  const along = model.placeAt;
  const nowhere = [NaN, NaN, NaN];

  // Links come as they begin and end; formations with their margins at each column.
  const again = (list, name) => before[list]?.find((each) => each.name === name);
  model.graphs = world.graphs.map((graph) => ({ ...graph, links: again("graphs", graph.name)?.links ?? linkRuns() }));
  model.formations = world.formations.map((each) => ({ ...each, margins: again("formations", each.name)?.margins ?? new Float32Array(each.edges.length * states).fill(-Infinity) }));
  // How couplings stand at a moment, where that is the present.
  model.couplingsAt = (time) => (model.now && time >= Math.min(model.now.t, (model.reached - 1) * world.step) - 1e-9 ? model.now.couplings : null);

  model.reached ??= 0;
  model.now ??= null;
  model.lanes = world.goals.map((goal, number) => ({
    ...goal,
    depth: 0,
    decided: null,
    effect: new Int32Array(states),
    values: { team: true, verdict: true, count: 1, least: new Float32Array(states), most: new Float32Array(states) },
    ...(before.lanes && kept(before.lanes[number])),
  }));
  // Of the present what was seen last; before it what was seen then.
  model.placeAt = (motion, agent, time) => {
    if (motion !== seen) return along(motion, agent, time);
    if (!model.now) return nowhere;
    if (time >= Math.min(model.now.t, (model.reached - 1) * world.step) - 1e-9) return model.now.place[agent] ? [...model.now.place[agent], 0].slice(0, 3) : nowhere;
    return along(motion, agent, time);
  };

  // What a message brings.
  model.take = ({ columns, now }) => {
    const { from, count } = columns;
    const [places, there, bounds, effect] = [columns.place, columns.seen, columns.bounds, columns.effect].map(unpack);
    for (let row = 0; row < dimension * agents; row++) {
      for (let column = 0; column < count; column++) {
        const known = there[(row % agents) * count + column];
        seen.position[row * states + from + column] = known ? places[row * count + column] / world.per_metre : NaN;
      }
    }
    const metres = (value) => (Math.abs(value) >= FAR ? Math.sign(value) * Infinity : value / world.per_metre);
    model.lanes.forEach((lane, number) => {
      for (let column = 0; column < count; column++) {
        lane.values.least[from + column] = metres(bounds[number * count + column]);
        lane.values.most[from + column] = metres(bounds[(model.lanes.length + number) * count + column]);
        lane.effect[from + column] = effect[number * count + column];
      }
    });
    for (const graph of model.graphs) graph.links.take(unpack(columns.changes[graph.name] ?? ""));
    for (const { name, edges, margins } of model.formations) {
      const fresh = unpack(columns.margins[name] ?? "");
      for (let edge = 0; edge < edges.length && fresh.length; edge++) for (let column = 0; column < count; column++) margins[edge * states + from + column] = metres(fresh[edge * count + column]);
    }
    model.reached = Math.max(model.reached, from + count);
    if (!now) return;
    model.now = now;
    for (const each of Object.values(now.couplings.graphs)) for (const kind of ["linked", "risk", "broken"]) each[kind] = pairsOf(unpack(each[kind]));
    model.stamp = (model.stamp ?? 0) + 1;
    model.lanes.forEach((lane, number) => {
      lane.now = now.goals[number];
      const open = lane.now.verdict === "open";
      lane.decided = open ? null : { step: lane.now.since / world.step, holds: lane.now.verdict === "satisfied" };
    });
  };
  return model;
}

const pairsOf = (numbers) => Array.from({ length: numbers.length / 2 }, (_, at) => [numbers[2 * at], numbers[2 * at + 1]]);

// Links as they begin and end, column by column; what is there at one, as of the report's graphs.
function linkRuns() {
  const runs = [];
  const open = new Map();
  return {
    take(changes) {
      for (let at = 0; at < changes.length; at += 4) {
        const [column, first, second, linked] = changes.subarray(at, at + 4);
        const key = `${first} ${second}`;
        if (linked) {
          open.set(key, { first, second, begin: column, end: Infinity });
          runs.push(open.get(key));
        } else open.get(key).end = column;
      }
    },
    at(step, visit) {
      for (const { first, second, begin, end } of runs) if (begin <= step && step <= end) visit(first, second, end === step ? "gone" : begin === step && step > 0 ? "new" : "there");
    },
  };
}

const kept = ({ effect, values, decided, now }) => ({ effect, values, decided, now });

// How much of the plan may be drawn is the report's affair; which motion the map shows is always what was seen.
const shownOfFlight = (model) => ({ ...shownFirst(model, null), motion: "seen", live: true });
