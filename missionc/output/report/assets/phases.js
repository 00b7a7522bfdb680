// The phases of a flight from the floor to the floor, in a bar: the mission is the part whose time runs on this page.
function phaseBar(model) {
  const whole = model.data.whole;
  if (!whole) return;
  const bar = document.getElementById("phases");
  bar.hidden = false;
  for (const { phase, begin, end } of whole.phases) {
    const part = Object.assign(document.createElement("span"), { textContent: phase, title: `${phase}: ${tidy(begin)} s to ${tidy(end)} s` });
    part.style.flexGrow = end - begin;
    part.dataset.phase = phase;
    bar.append(part);
  }
  const [first, last] = [whole.phases[0], whole.phases[whole.phases.length - 1]];
  bar.setAttribute("aria-label", `From the floor to the floor in ${tidy(last.end - first.begin)} s: ${whole.phases.map((each) => each.phase).join(", ")}`);
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
