// The world that does not move: its floor, what stands in it, and the paths.
function paintFloor(context, frame, { low, high, dimension }, palette) {
  const corners = [[low[0], low[1]], [high[0], low[1]], [high[0], high[1]], [low[0], high[1]]].map(([x, y]) => [x, y, low[2]]);
  polygon(context, corners.map(frame.point));
  context.fillStyle = palette.floor;
  context.fill();
  // Lines of the part that is seen, as far apart as people like.
  const seen = [[0, 0], [frame.width, 0], [frame.width, frame.height], [0, frame.height]].map(([px, py]) => frame.place(px, py));
  const span = [0, 1].map((axis) => [Math.max(low[axis], Math.min(...seen.map((each) => each[axis]))), Math.min(high[axis], Math.max(...seen.map((each) => each[axis])))]);
  const step = pleasant(Math.max(span[0][1] - span[0][0], span[1][1] - span[1][0], 1e-3), 10);
  const values = ([from, to]) => Array.from({ length: Math.max(0, Math.floor(to / step + 1e-6) - Math.ceil(from / step - 1e-6) + 1) }, (_, at) => (Math.ceil(from / step - 1e-6) + at) * step);
  const segment = (from, to) => line(context, ...frame.point(from), ...frame.point(to));
  context.strokeStyle = palette.grid;
  context.lineWidth = 1;
  for (const x of values(span[0])) segment([x, span[1][0], low[2]], [x, span[1][1], low[2]]);
  for (const y of values(span[1])) segment([span[0][0], y, low[2]], [span[0][1], y, low[2]]);
  context.strokeStyle = palette.faint;
  context.globalAlpha = frame.flat ? 1 : 0.6;
  polygon(context, corners.map(frame.point));
  context.stroke();
  if (dimension === 3 && !frame.flat) {
    polygon(context, corners.map(([x, y]) => frame.point([x, y, high[2]])));
    context.stroke();
    for (const [x, y] of corners) segment([x, y, low[2]], [x, y, high[2]]);
  }
  context.globalAlpha = 1;
  return { span, values };
}

// Numbers along the edges: of a map at its own sides, or the picture's where those are out of sight.
function paintScale(context, frame, { low, high, dimension }, palette, { span, values }) {
  context.font = "11px system-ui, sans-serif";
  context.textBaseline = "middle";
  if (frame.flat) {
    const bottom = Math.min(frame.point([0, low[1], low[2]])[1] + 12, frame.height - 10);
    const left = Math.max(frame.point([low[0], 0, low[2]])[0] - 6, 30);
    context.textAlign = "center";
    for (const x of values(span[0])) label(context, tidy(x), frame.point([x, 0, low[2]])[0], bottom, palette.faint, palette.paper);
    context.textAlign = "right";
    for (const y of values(span[1])) label(context, tidy(y), left, frame.point([0, y, low[2]])[1], palette.faint, palette.paper);
    return;
  }
  const tag = (text, place) => label(context, text, ...frame.point(place), palette.faint, palette.paper);
  const out = 0.04 * Math.max(high[0] - low[0], high[1] - low[1]);
  context.textAlign = "center";
  for (const x of values(span[0])) tag(tidy(x), [x, low[1] - out, low[2]]);
  for (const y of values(span[1])) tag(tidy(y), [low[0] - out, y, low[2]]);
  if (dimension === 3) tag(`${tidy(high[2])} m`, [low[0] - out, low[1] - out, high[2]]);
}

// The outline of a part at a height, as a path; several rings are a shape with holes.
function footprint(context, part, shift, height, frame) {
  const round = part.disc || part.ball;
  context.beginPath();
  if (round) {
    const [x, y] = frame.point([round[0] + shift[0], round[1] + shift[1], height]);
    const radius = round[round.length - 1] * frame.scale;
    context.ellipse(x, y, radius, radius * frame.rise, 0, 0, 2 * Math.PI);
    return;
  }
  for (const ring of part.rings) {
    ring.forEach(([x, y], corner) => context[corner ? "lineTo" : "moveTo"](...frame.point([x + shift[0], y + shift[1], height])));
    context.closePath();
  }
}

// A shape as it looks: from above its footprint, slanted its faces.
function paintShape(context, shape, shift, frame, look, grown = 0) {
  context.save();
  context.lineWidth = look.wide || 1;
  context.lineJoin = "round";
  for (const part of shape.parts) {
    const solid = !frame.flat && part.low !== undefined;
    if (part.ball && !frame.flat) paintBall(context, part.ball, shift, frame, look, grown);
    else if (solid) paintSolid(context, part, shift, frame, look, grown);
    else {
      const height = part.low === undefined ? (part.ball ? part.ball[2] : 0) + shift[2] : part.low;
      footprint(context, part, shift, height, frame);
      context.fillStyle = look.fill;
      context.globalAlpha = look.alpha;
      context.fill("evenodd");
      if (look.hatched) {
        paintHatching(context, look, frame);
        footprint(context, part, shift, height, frame);
      }
      context.globalAlpha = 1;
      context.setLineDash(look.dash || []);
      context.strokeStyle = look.stroke;
      context.stroke();
      if (grown) {
        // All places within some metres of it, around it.
        context.setLineDash([]);
        context.lineWidth = 2 * grown * frame.scale;
        context.globalAlpha = 0.3;
        context.stroke();
        context.lineWidth = look.wide || 1;
        context.globalAlpha = 1;
      }
    }
  }
  context.restore();
}

// Slanted lines within the path: told from a plain fill without its colour.
function paintHatching(context, look, frame) {
  context.save();
  context.clip("evenodd");
  context.beginPath();
  const [width, height] = [frame.width, frame.height];
  for (let at = -height; at < width; at += 9) {
    context.moveTo(at, height);
    context.lineTo(at + height, 0);
  }
  context.strokeStyle = look.stroke;
  context.globalAlpha = 0.35;
  context.lineWidth = 1;
  context.stroke();
  context.restore();
}

function paintBall(context, [x, y, z, radius], shift, frame, look, grown) {
  const [px, py] = frame.point([x + shift[0], y + shift[1], z + shift[2]]);
  context.fillStyle = look.fill;
  context.strokeStyle = look.stroke;
  context.globalAlpha = look.clear;
  circle(context, px, py, radius * frame.scale);
  context.fill();
  context.globalAlpha = 0.8;
  context.stroke();
  if (grown) {
    circle(context, px, py, (radius + grown) * frame.scale);
    context.globalAlpha = look.clear * 0.6;
    context.fill();
  }
  context.globalAlpha = 1;
}

function ringsOf(part) {
  if (part.rings) return part.rings;
  const [x, y, radius] = part.disc;
  return [Array.from({ length: 40 }, (_, corner) => [x + radius * Math.cos((corner * Math.PI) / 20), y + radius * Math.sin((corner * Math.PI) / 20)])];
}

function paintSolid(context, part, shift, frame, look, grown) {
  const faces = [];
  context.strokeStyle = look.stroke;
  context.setLineDash(look.dash || []);
  for (const ring of ringsOf(part)) {
    const at = (height) => ring.map(([x, y]) => [x + shift[0], y + shift[1], height + shift[2]]);
    const [bottom, top] = [at(part.low), at(part.high)];
    const sides = ring.map((_, corner) => [bottom[corner], bottom[(corner + 1) % ring.length], top[(corner + 1) % ring.length], top[corner]]);
    faces.push(bottom, top, ...sides);
    context.globalAlpha = 0.8;
    for (const cap of [bottom, top]) {
      polygon(context, cap.map(frame.point));
      context.stroke();
    }
    if (ring.length <= 12) ring.forEach((_, corner) => line(context, ...frame.point(bottom[corner]), ...frame.point(top[corner])));
  }
  context.setLineDash([]);
  if (grown) {
    // Seen in parallel, all places within some metres of a solid are those within as many of its picture.
    context.lineWidth = 2 * grown * frame.scale;
    context.globalAlpha = look.clear * 0.6;
    for (const face of faces) {
      polygon(context, face.map(frame.point));
      context.stroke();
    }
    context.lineWidth = 1;
  }
  context.fillStyle = look.fill;
  context.globalAlpha = look.clear;
  const depth = (face) => face.reduce((sum, place) => sum + frame.depth(place), 0) / face.length;
  for (const face of faces.map((each) => [depth(each), each]).sort((one, other) => other[0] - one[0])) {
    polygon(context, face[1].map(frame.point));
    context.fill();
  }
  context.globalAlpha = 1;
}

// How a region or an obstacle looks; a region by its role.
function lookOf(palette, shape, slanted) {
  if (!shape.role) return { fill: palette.obstacle, stroke: palette.obstacle, alpha: 0.9, clear: 0.3, ink: palette.on_obstacle, halo: palette.obstacle };
  const avoid = shape.role === "avoid";
  const [fill, stroke] = [palette.region[shape.role], palette.outline[shape.role]];
  return { fill: slanted ? stroke : fill, stroke, alpha: 0.85, clear: 0.16, dash: avoid ? [5, 3] : [], wide: 1.2, hatched: avoid, ink: palette.ink, halo: palette.floor };
}

// Of a world that changes: whether a region or an obstacle is there at a time.
const isThere = ({ from, until }, time) => from === undefined || (time >= from - 1e-9 && (until === null || time < until - 1e-9));
const isStill = ({ path, growth, from }) => !path && !growth && from === undefined;

function paintStanding(context, frame, model, palette) {
  const slanted = !frame.flat && model.dimension === 3;
  const standing = [...model.data.regions.filter(isStill), ...model.data.obstacles.filter(isStill)];
  const middle = (shape) => frame.depth([...shape.inner, (model.low[2] + model.high[2]) / 2]);
  if (slanted) standing.sort((one, other) => middle(other) - middle(one));
  for (const shape of standing) paintShape(context, shape, [0, 0, 0], frame, lookOf(palette, shape, slanted));
}

// One agent's way from a sample to another; what lies within a pixel of what was drawn is left out.
function trace(context, frame, model, motion, agent, first, last) {
  const { position, samples } = motion;
  const [x, y] = [agent * samples, (model.agents + agent) * samples];
  const z = model.dimension === 3 ? (2 * model.agents + agent) * samples : -1;
  const { ax, bx, ox, ay, by, cy, oy } = frame;
  let [px, py] = [NaN, NaN];
  for (let sample = first; sample <= last; sample++) {
    const [east, north, up] = [position[x + sample], position[y + sample], z < 0 ? 0 : position[z + sample]];
    const right = ox + ax * east + bx * north;
    const down = oy + ay * east + by * north + cy * up;
    if (sample > first && sample < last && Math.abs(right - px) < 1 && Math.abs(down - py) < 1) continue;
    context[sample === first ? "moveTo" : "lineTo"](right, down);
    [px, py] = [right, down];
  }
}

function paintPaths(context, frame, model, palette) {
  context.lineWidth = 1;
  for (const [name, motion] of Object.entries(model.motions)) {
    // Of a crowd more than one motion would be a tangle.
    if (model.crowd && name !== (model.motions.told ? "simulated" : "planned")) continue;
    context.setLineDash(model.crowd ? [] : model.dash(name));
    context.globalAlpha = model.crowd ? 0.16 : 0.45;
    for (let agent = 0; agent < model.agents; agent++) {
      context.strokeStyle = colourOf(palette, model.style[agent]);
      context.beginPath();
      trace(context, frame, model, motion, agent, 0, motion.samples - 1);
      context.stroke();
    }
  }
  context.setLineDash([]);
  context.globalAlpha = 1;
}
