// The model of a flight that goes on: the world as the report has it, and columns of time that fill.
// The same object again takes in another world or plan, and keeps what was seen.
function flightModel(world, plan, model = {}) {
  const motion = plan ? { planned: { rate: world.every, added: false, position: plan } } : {};
  const before = { ...model };
  Object.assign(model, readModel({ ...world, rows: [], lanes: [], charts: [], graphs: [], formations: [], checks: [], between: [], motion }));
  const { agents, states, dimension } = model;
  if (plan) model.motions.planned.samples = model.motions.planned.position.length / (dimension * agents);
  const seen = before.motions?.seen ?? { rate: 1, samples: states, position: new Float32Array(dimension * agents * states).fill(NaN) };
  // Not among those that are drawn as paths: it is a trail.
  Object.defineProperty(model.motions, "seen", { value: seen });
  const along = model.placeAt;
  const nowhere = [NaN, NaN, NaN];

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
    model.reached = Math.max(model.reached, from + count);
    if (!now) return;
    model.now = now;
    model.lanes.forEach((lane, number) => {
      lane.now = now.goals[number];
      const open = lane.now.verdict === "open";
      lane.decided = open ? null : { step: lane.now.since / world.step, holds: lane.now.verdict === "satisfied" };
    });
  };
  return model;
}

const kept = ({ effect, values, decided, now }) => ({ effect, values, decided, now });

// How much of the plan may be drawn is the report's affair; which motion the map shows is always what was seen.
const shownOfFlight = (model) => ({ ...shownFirst(model, null), motion: "seen", live: true });
