// What one lane or chart looks like over time.
const ROOM = { team: 30, agents: 46, strip: 16, chart: 66 };

function prepared(canvas, palette) {
  const ratio = window.devicePixelRatio || 1;
  const { clientWidth: width, clientHeight: height } = canvas;
  canvas.width = Math.round(width * ratio);
  canvas.height = Math.round(height * ratio);
  const context = canvas.getContext("2d");
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.fillStyle = palette.floor;
  context.fillRect(0, 0, width, height);
  return { context, width, height };
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

function drawLane(canvas, row, model, state, palette) {
  const { context, width, height } = prepared(canvas, palette);
  const one = row.team ? 0 : state.focus;
  const single = row.team || state.focus >= 0;
  const strip = single ? 0 : ROOM.strip;
  const bottom = height - 3 - strip;
  const chosen = single ? [one] : Array.from({ length: row.count }, (_, agent) => agent);
  let [low, high] = [0, 0];
  for (const agent of chosen) {
    for (let step = 0; step < model.states; step++) {
      const index = agent * model.states + step;
      if (!row.verdict && !row.asked[index]) continue;
      for (const value of [row.least[index], row.most[index]]) {
        if (Number.isFinite(value)) [low, high] = [Math.min(low, value), Math.max(high, value)];
      }
    }
  }
  const place = { across: (step) => (step / model.data.steps) * width, up: heights(low, high, 3, bottom), top: 3, bottom };
  if (single) drawArea(context, row, one, model, place, palette);
  else drawCrowd(context, row, model, place, palette);
  context.strokeStyle = palette.faint;
  context.globalAlpha = 0.6;
  context.lineWidth = 1;
  line(context, 0, place.up(0), width, place.up(0));
  context.globalAlpha = 1;
  if (strip) drawStrip(context, row, model, place, height - strip, strip - 1, palette);
}

// One line of values, filled down to zero in the colour of its truth.
function drawArea(context, row, agent, model, place, palette) {
  const start = agent * model.states;
  const zero = place.up(0);
  if (row.verdict) {
    for (const run of runs(row, agent, model)) {
      context.fillStyle = colourOfState(run.state, palette);
      context.globalAlpha = run.state === "open" ? 0.45 : 0.35;
      context.fillRect(place.across(run.begin), place.top, Math.max(2, place.across(run.end) - place.across(run.begin)), place.bottom - place.top);
    }
    context.globalAlpha = 1;
    drawBound(context, row.most, start, model, place, palette.ink, [3, 2]);
    drawBound(context, row.least, start, model, place, palette.ink, []);
    return;
  }
  for (const asked of [0, 1]) {
    for (const [colour, from, to] of [[palette.holds, 0, zero], [palette.fails, zero, place.bottom + 3]]) {
      context.save();
      context.beginPath();
      context.rect(0, from, place.across(model.data.steps) + 1, to - from);
      context.clip();
      context.fillStyle = colour;
      context.globalAlpha = asked ? 0.75 : 0.16;
      for (const [begin, end] of stretches(row, start, model, asked)) {
        context.beginPath();
        context.moveTo(place.across(begin), zero);
        for (let step = begin; step <= end; step++) context.lineTo(place.across(step), place.up(row.least[start + step]));
        // One step alone still has to be seen.
        if (begin === end) context.lineTo(place.across(begin) + 3, place.up(row.least[start + begin]));
        context.lineTo(place.across(begin === end ? begin : end) + (begin === end ? 3 : 0), zero);
        context.fill();
      }
      context.restore();
    }
  }
}

function drawBound(context, values, start, model, place, colour, dash) {
  context.strokeStyle = colour;
  context.lineWidth = 1.3;
  context.setLineDash(dash);
  context.beginPath();
  let pen = false;
  for (let step = 0; step < model.states; step++) {
    const value = values[start + step];
    if (Number.isFinite(value)) {
      context[pen ? "lineTo" : "moveTo"](place.across(step), place.up(value));
    }
    pen = Number.isFinite(value);
  }
  context.stroke();
  context.setLineDash([]);
}

// The lines of few agents, or the range of many.
function drawCrowd(context, row, model, place, palette) {
  const shown = (index) => (row.verdict ? Number.isFinite(row.most[index]) || Number.isFinite(row.least[index]) : row.asked[index]);
  const valueOf = (index) => (row.verdict && !Number.isFinite(row.most[index]) ? row.least[index] : row.most[index]);
  if (row.count <= 12) {
    for (let agent = 0; agent < row.count; agent++) {
      context.strokeStyle = colourOf(palette, agent);
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
  context.beginPath();
  for (const point of [...most, ...least.reverse()]) context.lineTo(...point);
  context.fill();
  context.globalAlpha = 1;
}

// Every agent's truth: a line of its own for each of few, the share of them for many.
function drawStrip(context, row, model, place, top, height, palette) {
  if (row.count <= 12) {
    const line = height / row.count;
    for (let agent = 0; agent < row.count; agent++) {
      for (const run of runs(row, agent, model)) {
        context.fillStyle = colourOfState(run.state, palette);
        context.globalAlpha = run.asked ? 0.9 : 0.22;
        context.fillRect(place.across(run.begin), top + agent * line, Math.max(2, place.across(run.end) - place.across(run.begin)), Math.max(1, line - 0.6));
      }
    }
    context.globalAlpha = 1;
    return;
  }
  for (let step = 0; step < model.states; step++) {
    const counts = { holds: 0, open: 0, fails: 0 };
    for (let agent = 0; agent < row.count; agent++) {
      const index = agent * model.states + step;
      if (row.verdict || row.asked[index]) counts[stateOf(row, index)]++;
    }
    let from = top + height;
    for (const [name, count] of Object.entries(counts)) {
      const tall = (count / row.count) * height;
      context.fillStyle = colourOfState(name, palette);
      context.fillRect(place.across(step), from - tall, place.across(1) + 0.5, tall);
      from -= tall;
    }
  }
}

const stateOf = (row, index) => (row.surely[index] ? "holds" : row.possibly[index] ? "open" : "fails");
const colourOfState = (state, palette) => palette[state];

// Neighbouring steps of one agent in the same state: [begin, end) in steps.
function runs(row, agent, model) {
  const found = [];
  for (let step = 0; step < model.states; step++) {
    const index = agent * model.states + step;
    const state = stateOf(row, index);
    const asked = row.verdict || Boolean(row.asked[index]);
    if (!row.verdict && !asked && row.least[index] === -Infinity) continue;
    const last = found[found.length - 1];
    if (last && last.end === step && last.state === state && last.asked === asked) last.end = step + 1;
    else found.push({ begin: step, end: step + 1, state, asked });
  }
  return found;
}

// The steps of one agent that are asked, or not and yet have a value: [first, last].
function stretches(row, start, model, asked) {
  const found = [];
  for (let step = 0; step < model.states; step++) {
    if (row.asked[start + step] !== asked || (!asked && row.least[start + step] === -Infinity)) continue;
    const last = found[found.length - 1];
    if (last && last[1] === step - 1) last[1] = step;
    else found.push([step, step]);
  }
  return found;
}

function drawChart(canvas, chart, model, palette) {
  const { context, width, height } = prepared(canvas, palette);
  let [low, high] = [0, 0];
  for (const series of chart.series) for (const value of series.values) if (Number.isFinite(value)) [low, high] = [Math.min(low, value), Math.max(high, value)];
  for (const limit of chart.limits) high = Math.max(high, limit.value);
  if (chart.low) high = Math.min(high, Math.max(...chart.limits.map((limit) => limit.value * 12), 1, ...chart.series.map((each) => each.values.reduce((least, value) => Math.min(least, value), Infinity) * 6)));
  const [top, bottom] = [6, height - 5];
  const up = (value) => bottom - ((Math.min(value, high) - low) / (high - low || 1)) * (bottom - top);
  const teams = [...new Set(chart.series.map((each) => each.team))];
  for (const limit of chart.limits) {
    context.fillStyle = palette.fails;
    context.globalAlpha = 0.1;
    if (chart.low) context.fillRect(0, up(limit.value), width, height - up(limit.value));
    else context.fillRect(0, 0, width, up(limit.value));
    context.globalAlpha = 1;
    context.strokeStyle = palette.fails;
    context.setLineDash([6, 3]);
    line(context, 0, up(limit.value), width, up(limit.value));
    context.setLineDash([]);
  }
  for (const series of chart.series) {
    context.strokeStyle = teams.length > 1 ? colourOf(palette, teams.indexOf(series.team)) : palette.ink;
    context.lineWidth = series.motion === "flown" ? 1.6 : 1.1;
    context.setLineDash(teams.length === chart.series.length ? [] : model.dash(series.motion));
    context.beginPath();
    series.values.forEach((value, sample) => context.lineTo((sample / (series.values.length - 1)) * width, up(value)));
    context.stroke();
  }
  context.setLineDash([]);
  context.font = "10px system-ui, sans-serif";
  context.textAlign = "left";
  context.textBaseline = "top";
  label(context, `${short(high)} ${chart.unit}`, 3, 2, palette.faint, palette.floor);
  context.textBaseline = "bottom";
  label(context, `${short(low)}`, 3, height - 1, palette.faint, palette.floor);
}

// Three digits, never more than a millimetre.
function short(value) {
  if (value === 0) return "0";
  if (value === Infinity) return "∞";
  if (value === -Infinity) return "−∞";
  const digits = Math.abs(value) >= 100 ? 0 : Math.abs(value) >= 10 ? 1 : Math.abs(value) >= 1 ? 2 : 3;
  return value.toFixed(digits).replace("-", "−");
}
