// What the page knows, unpacked; nothing here draws.
const FAR = 1 << 27;

function readModel(data) {
  const agents = data.agents.length;
  const states = data.steps + 1;
  const dimension = data.world.low.length;
  const horizon = data.step * data.steps;

  // Packed rows of values: (agents or 1, states).
  const metres = (text) => Float32Array.from(unpack(text), (value) => (Math.abs(value) >= FAR ? Math.sign(value) * Infinity : value / data.per_metre));
  const rows = data.rows.map((row) => {
    const least = metres(row.least);
    const surely = unpack(row.surely);
    return {
      team: row.team,
      verdict: row.verdict,
      count: row.team ? 1 : agents,
      asked: unpack(row.asked),
      least,
      surely,
      most: row.verdict ? metres(row.most) : least,
      possibly: row.verdict ? unpack(row.possibly) : surely,
      lit: row.lit ? unpack(row.lit) : null,
      links: row.links ? readRuns(row.links) : [],
      formations: row.formations || [],
    };
  });

  const motions = {};
  for (const [name, packed] of Object.entries(data.motion)) {
    const samples = packed.rate * data.steps + 1;
    const position = Float32Array.from(unpack(packed.position), (value) => value / data.per_metre);
    motions[name] = { rate: packed.rate, samples, position };
  }

  // Dots for what is planned beside what is flown, dashes for what a simulator made of it.
  const dash = (name) => (name === "simulated" ? [8, 3] : name === "planned" && motions.flown ? [2, 4] : []);

  // The place of an agent at a time, straight between two samples.
  function placeAt(motion, agent, time) {
    const at = Math.min(Math.max((time / data.step) * motion.rate, 0), motion.samples - 1);
    const before = Math.min(Math.floor(at), motion.samples - 2);
    const share = at - before;
    const place = [];
    for (let axis = 0; axis < dimension; axis++) {
      const index = (axis * agents + agent) * motion.samples + before;
      place.push(motion.position[index] * (1 - share) + motion.position[index + 1] * share);
    }
    return place;
  }

  const stepAt = (time) => Math.min(data.steps, Math.floor(time / data.step + 1e-6));

  return {
    data,
    agents,
    states,
    dimension,
    horizon,
    rows,
    motions,
    placeAt,
    dash,
    stepAt,
    within: (time) => Math.min(horizon, Math.max(0, time)),
    graphs: data.graphs.map((graph) => ({ name: graph.name, directed: graph.directed, runs: readRuns(graph.runs) })),
    formations: data.formations.map((formation) => ({ ...formation, margins: metres(formation.margins) })),
    charts: data.charts.map((chart) => ({ ...chart, series: chart.series.map((each) => ({ ...each, values: metres(each.values) })) })),
    grownAt: (obstacle, time) => obstacle.growth * time,
    shiftAt: (obstacle, time) => (obstacle.path ? interpolated(obstacle.path, time) : Array(dimension).fill(0)),
  };
}

// Links, each with its two ends, the step it begins at and the step it has ended by.
function readRuns(text) {
  const numbers = unpack(text);
  const count = numbers.length / 4;
  return Array.from({ length: count }, (_, run) => [0, 1, 2, 3].map((field) => numbers[field * count + run]));
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
