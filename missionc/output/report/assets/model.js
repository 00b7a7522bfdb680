// What the page knows, unpacked; nothing here draws. Rows are unpacked when they are first looked at.
const FAR = 1 << 27;
const CROWD = 16;

function readModel(data) {
  const agents = data.agents.length;
  const states = data.steps + 1;
  const dimension = data.world.low.length;
  const horizon = data.step * data.steps;
  const teams = [...new Set(data.agents.map((agent) => agent.team))];
  const crowd = agents > CROWD;

  // Packed rows of values: (agents or 1, states).
  const metres = (text, per = data.per_metre) => Float32Array.from(unpack(text), (value) => (Math.abs(value) >= FAR ? Math.sign(value) * Infinity : value / per));
  const rows = data.rows.map((row) =>
    lazily(
      { team: row.team, verdict: row.verdict, count: row.team ? 1 : agents, formations: row.formations || [] },
      {
        least: () => metres(row.least, row.per_metre),
        surely: () => unpack(row.surely),
        most: (own) => (row.verdict ? metres(row.most, row.per_metre) : own.least),
        lit: () => (row.lit ? unpack(row.lit) : null),
        links: () => (row.links ? runsByStep(unpack(row.links), states) : null),
      },
    ),
  );
  const lanes = data.lanes.map((lane) => lazily({ ...lane, values: rows[lane.row] }, { effect: () => unpack(lane.effect) }));
  lanes.forEach((lane, index) => {
    lane.index = index;
    lane.folds = Boolean(lanes[index + 1] && lanes[index + 1].depth > lane.depth);
  });

  const motions = readMotions(data);
  // Dots for what is planned beside what is flown, dashes for what a simulator made of it.
  // Of a flight in a closed loop the flight itself is solid, and what was uploaded has dashes and dots.
  const dash = (name) => {
    if (name === "planned") return motions.flown || motions.told ? [2, 4] : [];
    return { told: [8, 3, 2, 3], simulated: motions.told ? [] : [8, 3] }[name] ?? [];
  };

  // The place of an agent at a time, straight between two samples; at height 0 in a plane.
  function placeAt(motion, agent, time) {
    const at = Math.min(Math.max((time / data.step) * motion.rate, 0), motion.samples - 1);
    const before = Math.max(0, Math.min(Math.floor(at), motion.samples - 2));
    const share = at - before;
    const place = [0, 0, 0];
    for (let axis = 0; axis < dimension; axis++) {
      const index = (axis * agents + agent) * motion.samples + before;
      const after = motion.samples > 1 ? motion.position[index + 1] : motion.position[index];
      place[axis] = motion.position[index] * (1 - share) + after * share;
    }
    return place;
  }

  return {
    data,
    agents,
    states,
    dimension,
    horizon,
    rows,
    lanes,
    motions,
    teams,
    crowd,
    crowded: data.obstacles.length > CROWD,
    placeAt,
    dash,
    low: [...data.world.low, 0].slice(0, 3),
    high: [...data.world.high, 0].slice(0, 3),
    style: data.agents.map((agent, index) => (crowd ? teams.indexOf(agent.team) : index)),
    stepAt: (time) => Math.min(data.steps, Math.floor(time / data.step + 1e-6)),
    within: (time) => Math.min(horizon, Math.max(0, time)),
    graphs: data.graphs.map((graph) => lazily({ name: graph.name, directed: graph.directed }, { links: () => runsByStep(unpack(graph.runs), states) })),
    formations: data.formations.map((formation) => lazily({ name: formation.name, edges: formation.edges }, { margins: () => metres(formation.margins) })),
    charts: data.charts.map((chart) => ({ ...chart, series: chart.series.map((each) => lazily({ motion: each.motion, team: each.team }, { values: () => metres(each.values) })) })),
    goneAt: data.agents.map((agent) => data.loop?.gone[agent.name] ?? Infinity),
    grownAt: (obstacle, time) => obstacle.growth * Math.max(0, time + obstacle.age),
    shiftAt: (obstacle, time) => (obstacle.path ? [...interpolated(obstacle.path, time), 0].slice(0, 3) : [0, 0, 0]),
  };
}

const MOTIONS = { flown: "trajectory", told: "commanded" };
const motionName = (name) => MOTIONS[name] ?? name;

// An object some of whose fields are made when they are first asked for.
function lazily(object, makers) {
  for (const [name, make] of Object.entries(makers)) {
    Object.defineProperty(object, name, {
      configurable: true,
      enumerable: true,
      get() {
        const value = make(object);
        Object.defineProperty(object, name, { value, enumerable: true });
        return value;
      },
    });
  }
  return object;
}

function readMotions(data) {
  const motions = {};
  const packed = Object.entries(data.motion).sort(([, one], [, other]) => one.added - other.added);
  for (const [name, { rate, added, position }] of packed) {
    const numbers = unpack(position);
    const metres = Float32Array.from(numbers, (value) => value / data.per_metre);
    if (added) for (let index = 0; index < metres.length; index++) metres[index] += motions.planned.position[index];
    motions[name] = { rate, samples: rate * data.steps + 1, position: metres };
  }
  return motions;
}

// Links, each with its two ends, the step it begins at and the step it has ended by; by step, in one array of the
// numbers of runs that are there, and that ended just now.
function runsByStep(numbers, states) {
  const count = numbers.length / 4;
  const [first, second, begin, end] = [0, 1, 2, 3].map((field) => numbers.subarray(field * count, (field + 1) * count));
  const start = new Int32Array(states + 2);
  for (let run = 0; run < count; run++) for (let step = begin[run]; step <= Math.min(end[run], states - 1); step++) start[step + 1]++;
  for (let step = 1; step < start.length; step++) start[step] += start[step - 1];
  const runs = new Int32Array(start[states + 1] || 0);
  const place = start.slice();
  for (let run = 0; run < count; run++) for (let step = begin[run]; step <= Math.min(end[run], states - 1); step++) runs[place[step]++] = run;
  return {
    at(step, visit) {
      for (let index = start[step]; index < start[step + 1]; index++) {
        const run = runs[index];
        visit(first[run], second[run], end[run] === step ? "gone" : begin[run] === step && step > 0 ? "new" : "there");
      }
    },
  };
}

function interpolated(path, time) {
  const last = path.times.length - 1;
  if (time <= path.times[0]) return path.offsets[0];
  if (time >= path.times[last]) return path.offsets[last];
  let after = 1;
  while (path.times[after] < time) after++;
  const share = (time - path.times[after - 1]) / (path.times[after] - path.times[after - 1]);
  return path.offsets[after].map((value, axis) => path.offsets[after - 1][axis] * (1 - share) + value * share);
}
