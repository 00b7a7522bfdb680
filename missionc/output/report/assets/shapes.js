// Outlines on a canvas, seen from above.
function outline(context, part, shift, across, up, scale) {
  context.beginPath();
  if (part.rings) {
    for (const ring of part.rings) {
      ring.forEach(([x, y], corner) => {
        const method = corner ? "lineTo" : "moveTo";
        context[method](across(x + shift[0]), up(y + shift[1]));
      });
      context.closePath();
    }
    return;
  }
  const round = part.disc || part.ball;
  context.arc(across(round[0] + shift[0]), up(round[1] + shift[1]), round[round.length - 1] * scale, 0, 2 * Math.PI);
}

function paintShape(context, shape, shift, frame, fill, stroke, alpha) {
  context.save();
  context.fillStyle = fill;
  context.strokeStyle = stroke;
  context.lineWidth = 1;
  for (const part of shape.parts) {
    outline(context, part, shift, frame.across, frame.up, frame.scale);
    context.globalAlpha = alpha;
    context.fill("evenodd");
    context.globalAlpha = 1;
    context.stroke();
  }
  context.restore();
}

// All places within some metres of a shape, around it.
function paintGrown(context, shape, shift, frame, colour, metres) {
  if (!metres) return;
  context.save();
  context.strokeStyle = colour;
  context.lineWidth = 2 * metres * frame.scale;
  context.lineJoin = "round";
  context.globalAlpha = 0.3;
  for (const part of shape.parts) {
    outline(context, part, shift, frame.across, frame.up, frame.scale);
    context.stroke();
  }
  context.restore();
}

// Text with a halo, so that it can be read on whatever it lies.
function label(context, text, x, y, colour, halo) {
  context.lineWidth = 3;
  context.lineJoin = "round";
  context.strokeStyle = halo;
  context.strokeText(text, x, y);
  context.fillStyle = colour;
  context.fillText(text, x, y);
}

// A step between lines of a grid or axis that people like: 1, 2 or 5 times a power of ten.
function pleasant(range, lines) {
  const rough = range / lines;
  const power = 10 ** Math.floor(Math.log10(rough));
  return [1, 2, 5, 10].map((times) => times * power).find((step) => step >= rough);
}

// What the views have in common: which links, routes and formations are there at a step, and who is lit.
function happenings(model, state) {
  const step = model.stepAt(state.time);
  const row = state.shown === null ? null : model.rows[model.data.lanes[state.shown].row];
  const graph = model.graphs.find((each) => each.name === state.graph);
  const links = [];
  for (const [first, second, begin, end] of graph ? graph.runs : []) {
    if (begin <= step && step < end) links.push({ first, second, kind: begin === step && step > 0 ? "new" : "there" });
    else if (end === step) links.push({ first, second, kind: "gone" });
  }
  if (graph && graph.directed) {
    const there = new Set(links.filter((link) => link.kind !== "gone").map((link) => `${link.first} ${link.second}`));
    for (const link of links) link.oneWay = !there.has(`${link.second} ${link.first}`);
  }
  const route = row ? row.links.filter(([, , begin, end]) => begin <= step && step < end) : [];
  const lit = (agent) => (row && row.lit ? row.lit[agent * model.states + step] : 0);
  const edges = [];
  for (const formation of model.formations) {
    if (!row || !row.formations.includes(formation.name)) continue;
    formation.edges.forEach(([first, second], edge) => {
      edges.push({ first, second, kept: formation.margins[edge * model.states + step] >= 0 });
    });
  }
  return { step, links, route, lit, edges, any: Boolean(row) };
}
