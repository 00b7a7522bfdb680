// What one chart of distances, speeds or levels looks like.
function drawChart(canvas, chart, model, palette) {
  const { context, width, height, across } = prepared(canvas, palette, model);
  let [low, high] = [0, 0];
  for (const series of chart.series) for (const value of series.values) if (Number.isFinite(value)) [low, high] = [Math.min(low, value), Math.max(high, value)];
  for (const limit of chart.limits) high = Math.max(high, limit.value);
  // Where the least counts, what is far above it would only press it flat.
  const leastOf = (series) => series.values.reduce((least, value) => Math.min(least, value), Infinity);
  if (chart.low) high = Math.min(high, Math.max(...chart.limits.map((limit) => limit.value * 12), 1, ...chart.series.map((each) => leastOf(each) * 6)));
  const [top, bottom] = [7, height - 7];
  const up = (value) => bottom - ((Math.min(value, high) - low) / (high - low || 1)) * (bottom - top);
  const teams = [...new Set(chart.series.map((each) => each.team))];
  for (const limit of chart.limits) {
    context.fillStyle = palette.harms;
    context.globalAlpha = 0.1;
    if (chart.low) context.fillRect(GUTTER, up(limit.value), width, height - up(limit.value));
    else context.fillRect(GUTTER, 0, width, up(limit.value));
    context.globalAlpha = 1;
    context.strokeStyle = palette.harms;
    context.setLineDash([6, 3]);
    line(context, GUTTER, up(limit.value), width, up(limit.value));
    context.setLineDash([]);
  }
  chart.series.forEach((series, number) => {
    const team = teams.length > 1 ? teams.indexOf(series.team) : -1;
    context.strokeStyle = team < 0 ? palette.ink : colourOf(palette, team);
    context.lineWidth = series.motion === "flown" ? 1.6 : 1.1;
    context.setLineDash(teams.length === chart.series.length ? (number ? [2 + 2 * number, 2] : []) : model.dash(series.motion));
    context.beginPath();
    let [px, py] = [NaN, NaN];
    series.values.forEach((value, sample) => {
      const [x, y] = [across(sample / (series.values.length - 1)), up(value)];
      if (Math.abs(x - px) < 0.5 && Math.abs(y - py) < 0.5) return;
      context[sample ? "lineTo" : "moveTo"](x, y);
      [px, py] = [x, y];
    });
    context.stroke();
  });
  context.setLineDash([]);
  paintAxis(context, palette, [[short(high), top], [short(low), bottom], ...chart.limits.map((limit) => [short(limit.value), up(limit.value)])]);
}

function limitsOf(chart) {
  const many = new Set(chart.series.map((each) => each.team)).size > 1;
  const most = chart.low ? "at least" : "at most";
  return chart.limits.length
    ? chart.limits.map((limit) => `${most} ${short(limit.value)}${chart.unit && ` ${chart.unit}`} (${limit.by}${many && limit.team ? ` of ${limit.team}` : ""})`).join(", ")
    : "no limit";
}

function chartNow(chart, model, time) {
  const many = new Set(chart.series.map((each) => each.team)).size > 1;
  const valueOf = (series) => series.values[Math.round((time / model.horizon) * (series.values.length - 1))];
  return chart.series.map((each) => `${motionName(each.motion)}${each.team && many ? ` ${each.team}` : ""} ${short(valueOf(each))}`).join(" · ");
}
