// What one lane looks like over time.
const ROOM = { goal: 48, team: 34, agents: 48, strip: 16, chart: 70 };
const GUTTER = 46;

function prepared(canvas, palette, model) {
  const ratio = window.devicePixelRatio || 1;
  const { clientWidth: width, clientHeight: height } = canvas;
  canvas.width = Math.round(width * ratio);
  canvas.height = Math.round(height * ratio);
  const context = canvas.getContext("2d");
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.fillStyle = palette.floor;
  context.fillRect(0, 0, width, height);
  // Lines of time, where the bar above has its seconds.
  context.strokeStyle = palette.grid;
  context.lineWidth = 1;
  const gap = pleasant(model.horizon, 10);
  for (let time = 0; time <= model.horizon + 1e-9; time += gap) {
    const x = GUTTER + (time / model.horizon) * (width - GUTTER);
    line(context, x, 0, x, height);
  }
  return { context, width, height, across: (share) => GUTTER + share * (width - GUTTER) };
}

// The numbers of an axis, at its left: each at its height, left out where it would lie on the one before.
function paintAxis(context, palette, marks) {
  context.font = "10px system-ui, sans-serif";
  context.textAlign = "right";
  context.textBaseline = "middle";
  const taken = [];
  for (const [text, y] of marks) {
    if (taken.some((other) => Math.abs(other - y) < 10)) continue;
    taken.push(y);
    label(context, text, GUTTER - 5, y, palette.faint, palette.floor);
  }
}

// Heights of robustness: near zero it counts most, so a square root of a kind.
function heights(low, high, top, bottom) {
  const bend = (value) => Math.asinh(value / 0.1);
  const [least, most] = [bend(Math.min(low, 0)), bend(Math.max(high, 0))];
  const range = most - least || 1;
  return (value) => {
    if (value === Infinity) return top;
    if (value === -Infinity) return bottom;
    return bottom - ((bend(value) - least) / range) * (bottom - top);
  };
}

function drawLane(canvas, lane, model, state, palette) {
  const row = lane.values;
  const { context, height, across } = prepared(canvas, palette, model);
  const one = row.team ? 0 : state.focus;
  const single = row.team || state.focus >= 0;
  const strip = single ? 0 : ROOM.strip;
  const [top, bottom] = [6, height - 6 - strip];
  let [low, high] = [0, 0];
  for (let agent = single ? one : 0; agent < (single ? one + 1 : row.count); agent++) {
    for (let index = agent * model.states; index < (agent + 1) * model.states; index++) {
      if (!lane.effect[index]) continue;
      for (const value of [row.least[index], row.most[index]]) if (Number.isFinite(value)) [low, high] = [Math.min(low, value), Math.max(high, value)];
    }
  }
  const place = { across: (step) => across(step / Math.max(1, model.data.steps)), up: heights(low, high, top, bottom), top, bottom };
  if (single) drawArea(context, lane, one, model, place, palette);
  else drawCrowd(context, lane, model, place, palette);
  context.strokeStyle = palette.faint;
  context.globalAlpha = 0.6;
  context.lineWidth = 1;
  line(context, GUTTER, place.up(0), place.across(model.data.steps), place.up(0));
  context.globalAlpha = 1;
  if (strip) drawStrip(context, lane, model, place, height - strip, strip - 1, palette);
  if (lane.decided) drawDecided(context, lane.decided, place, palette, height);
  paintAxis(context, palette, [["0", place.up(0)], ...(high > 0 ? [[`+${short(high)}`, top]] : []), ...(low < 0 ? [[short(low), bottom]] : [])]);
}

// The moment from which nothing changes a verdict any more.
function drawDecided(context, decided, place, palette, height) {
  const x = place.across(decided.step);
  context.strokeStyle = decided.holds ? palette.helps : palette.harms;
  context.lineWidth = 2;
  line(context, x, 0, x, height);
}

// One line of values, filled down to zero in the colour of what they do to the requirement.
function drawArea(context, lane, agent, model, place, palette) {
  const row = lane.values;
  const start = agent * model.states;
  const zero = place.up(0);
  for (const run of runs(lane, agent, model)) {
    // What has not been reached yet, where time goes on, is left blank.
    const end = Math.min(run.end, model.data.steps, (model.reached ?? model.states) - 1);
    const [from, to] = [place.across(run.begin), Math.max(place.across(run.begin) + 2, place.across(end))];
    context.fillStyle = palette[run.state];
    if (row.verdict) {
      context.globalAlpha = run.state === "open" ? 0.45 : 0.35;
      context.fillRect(from, place.top, to - from, place.bottom - place.top);
      continue;
    }
    context.globalAlpha = 0.75;
    context.beginPath();
    context.moveTo(from, zero);
    const last = Math.min(run.end, model.data.steps);
    for (let step = run.begin; step <= last; step++) context.lineTo(place.across(step), place.up(row.least[start + step]));
    // One step alone still has to be seen.
    if (last === run.begin) context.lineTo(to, place.up(row.least[start + run.begin]));
    context.lineTo(to, zero);
    context.fill();
  }
  context.globalAlpha = 1;
  drawBound(context, lane, row.most, start, model, place, palette.ink, row.verdict ? [3, 2] : []);
  if (row.verdict) drawBound(context, lane, row.least, start, model, place, palette.ink, []);
}

function drawBound(context, lane, values, start, model, place, colour, dash) {
  context.strokeStyle = colour;
  context.lineWidth = 1.3;
  context.setLineDash(dash);
  context.beginPath();
  let pen = false;
  for (let step = 0; step < model.states; step++) {
    const there = Number.isFinite(values[start + step]) && lane.effect[start + step];
    if (there) context[pen ? "lineTo" : "moveTo"](place.across(step), place.up(values[start + step]));
    pen = there;
  }
  context.stroke();
  context.setLineDash([]);
}

// The lines of few agents, or the range of many.
function drawCrowd(context, lane, model, place, palette) {
  const row = lane.values;
  const shown = (index) => lane.effect[index] && (!row.verdict || Number.isFinite(row.most[index]) || Number.isFinite(row.least[index]));
  const valueOf = (index) => (row.verdict && !Number.isFinite(row.most[index]) ? row.least[index] : row.most[index]);
  if (row.count <= 12) {
    for (let agent = 0; agent < row.count; agent++) {
      context.strokeStyle = colourOf(palette, model.style[agent]);
      context.lineWidth = 1.2;
      context.globalAlpha = 0.9;
      context.beginPath();
      let pen = false;
      for (let step = 0; step < model.states; step++) {
        const index = agent * model.states + step;
        if (shown(index)) context[pen ? "lineTo" : "moveTo"](place.across(step), place.up(valueOf(index)));
        pen = shown(index);
      }
      context.stroke();
    }
    context.globalAlpha = 1;
    return;
  }
  const [least, most] = [[], []];
  for (let step = 0; step < model.states; step++) {
    let [low, high] = [Infinity, -Infinity];
    for (let agent = 0; agent < row.count; agent++) {
      const index = agent * model.states + step;
      if (shown(index)) [low, high] = [Math.min(low, valueOf(index)), Math.max(high, valueOf(index))];
    }
    if (low > high) continue;
    least.push([place.across(step), place.up(low)]);
    most.push([place.across(step), place.up(high)]);
  }
  context.fillStyle = palette.faint;
  context.globalAlpha = 0.3;
  polygon(context, [...most, ...least.reverse()]);
  context.fill();
  context.globalAlpha = 1;
}

// What every agent does to it: a line of its own for each of few, the share of them for many.
function drawStrip(context, lane, model, place, top, height, palette) {
  const count = lane.values.count;
  if (count <= 12) {
    const tall = height / count;
    for (let agent = 0; agent < count; agent++) {
      for (const run of runs(lane, agent, model)) {
        context.fillStyle = palette[run.state];
        const end = Math.min(run.end, model.data.steps);
        context.fillRect(place.across(run.begin), top + agent * tall, Math.max(2, place.across(end) - place.across(run.begin)), Math.max(1, tall - 0.6));
      }
    }
    return;
  }
  const wide = place.across(1) - place.across(0) + 0.5;
  // No more than one bar for a pixel.
  const stride = Math.max(1, Math.floor(1 / wide));
  for (let step = 0; step < model.states; step += stride) {
    const counts = countsAt(lane, model, step);
    let from = top + height;
    for (const name of ["helps", "neither", "open", "harms"]) {
      const tall = (counts[name] / count) * height;
      context.fillStyle = palette[name];
      if (tall) context.fillRect(place.across(step), from - tall, Math.max(1, wide * stride), tall);
      from -= tall;
    }
  }
}

function countsAt(lane, model, step) {
  const counts = { absent: 0, helps: 0, harms: 0, neither: 0, open: 0 };
  for (let index = step; index < lane.effect.length; index += model.states) counts[EFFECTS[lane.effect[index]]]++;
  return counts;
}

// Neighbouring steps at which a value of one agent does the same: [begin, end) in steps.
function runs(lane, agent, model) {
  const found = [];
  for (let step = 0; step < model.states; step++) {
    const state = EFFECTS[lane.effect[agent * model.states + step]];
    const last = found[found.length - 1];
    if (last && last.end === step && last.state === state) last.end = step + 1;
    else if (state !== "absent") found.push({ begin: step, end: step + 1, state });
  }
  return found;
}
