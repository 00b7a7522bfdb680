// The phases of a flight, in a bar: from the floor to the floor, where the mission is the part whose time runs on this
// page; or of one that goes on by another plan what was flown before, and the plan, whose time it is then.
function phaseBar(model) {
  const { whole, past } = model.data;
  const phases = (past || whole)?.phases;
  if (!phases) return;
  const bar = document.getElementById("phases");
  bar.hidden = false;
  for (const { phase, begin, end } of phases) {
    const span = `${tidy(begin)}${past ? "–" : " s to "}${tidy(end)} s`;
    const part = Object.assign(document.createElement("span"), { textContent: past ? `${phaseName(phase)} ${span}` : phaseName(phase), title: `${phaseName(phase)}: ${span}` });
    part.style.flexGrow = end - begin;
    part.dataset.phase = phase;
    bar.append(part);
  }
  const [first, last] = [phases[0], phases[phases.length - 1]];
  const what = past ? "Whole flight; the plan is its last part" : "Whole flight from takeoff to landing";
  bar.setAttribute("aria-label", `${what}, ${tidy(last.end - first.begin)} s: ${[...bar.children].map((each) => each.textContent).join(", ")}`);
}

const PHASES = { rise: "takeoff", out: "flight to the starts", home: "flight to the pads", land: "landing", flown: "recorded", told: "commanded" };
const phaseName = (phase) => PHASES[phase] ?? phase;

// A time of the page on the clock of the whole flight, where that began before.
const flightClock = ({ past }, time, digits) => (past ? ` · flight ${(past.begins + time).toFixed(digits)} s` : "");

// What was flown before the plan begins, pale and solid, and what was told until then, dashed. Who was lost ends in a cross.
function paintPast(context, frame, model, palette) {
  const { past } = model.data;
  if (!past) return;
  context.globalAlpha = 0.75;
  for (const { agent, flown, places } of past.ways) {
    Object.assign(context, { strokeStyle: palette.faint, lineWidth: 1.4 });
    const points = places.map((place) => frame.point(place));
    for (const [from, to, dash] of [[0, flown, []], [flown - 1, points.length, [4, 3]]]) {
      context.setLineDash(dash);
      context.beginPath();
      points.slice(Math.max(0, from), to).forEach((point, at) => context[at ? "lineTo" : "moveTo"](...point));
      context.stroke();
    }
    context.setLineDash([]);
    if (past.lost.includes(agent)) cross(context, ...points[Math.min(flown, points.length) - 1], palette.harms);
  }
  context.globalAlpha = 1;
}

function cross(context, x, y, colour) {
  Object.assign(context, { strokeStyle: colour, lineWidth: 2 });
  line(context, x - 6, y - 6, x + 6, y + 6);
  line(context, x - 6, y + 6, x + 6, y - 6);
}

// The ways before and after the mission, dotted, and the pads that they are from and to.
function paintWays(context, frame, model, palette) {
  const whole = model.data.whole;
  if (!whole) return;
  context.lineWidth = 1.2;
  context.setLineDash([1, 4]);
  context.lineCap = "round";
  context.globalAlpha = 0.8;
  for (const way of whole.ways) {
    way.forEach((points, agent) => {
      context.strokeStyle = colourOf(palette, model.style[agent]);
      context.beginPath();
      points.forEach((point, at) => context[at ? "lineTo" : "moveTo"](...frame.point(point)));
      context.stroke();
    });
  }
  context.setLineDash([]);
  context.lineCap = "butt";
  whole.pads.forEach((pad, agent) => {
    const [x, y] = frame.point(pad);
    context.strokeStyle = colourOf(palette, model.style[agent]);
    context.strokeRect(x - 5, y - 5, 10, 10);
  });
  context.globalAlpha = 1;
}
