// The world from above. What does not move is drawn once for each size, theme and choice of layers.
function planView(model) {
  const { low, high } = model.data.world;
  const still = document.createElement("canvas");
  let stillKey = "";

  function frameOf(width, height) {
    const edge = { left: 34, right: 14, top: 12, bottom: 26 };
    const scale = Math.min((width - edge.left - edge.right) / (high[0] - low[0]), (height - edge.top - edge.bottom) / (high[1] - low[1]));
    const left = edge.left + (width - edge.left - edge.right - scale * (high[0] - low[0])) / 2;
    const top = edge.top + (height - edge.top - edge.bottom - scale * (high[1] - low[1])) / 2;
    return { scale, across: (x) => left + (x - low[0]) * scale, up: (y) => top + (high[1] - y) * scale };
  }

  function paintGrid(context, frame, palette) {
    context.fillStyle = palette.floor;
    context.fillRect(frame.across(low[0]), frame.up(high[1]), (high[0] - low[0]) * frame.scale, (high[1] - low[1]) * frame.scale);
    context.font = "11px system-ui, sans-serif";
    const step = pleasant(Math.max(high[0] - low[0], high[1] - low[1]), 10);
    context.strokeStyle = palette.grid;
    context.fillStyle = palette.faint;
    context.lineWidth = 1;
    context.textAlign = "center";
    context.textBaseline = "top";
    const tidy = (value) => String(Number(value.toFixed(6)));
    for (let x = Math.ceil(low[0] / step) * step; x <= high[0] + 1e-9; x += step) {
      line(context, frame.across(x), frame.up(low[1]), frame.across(x), frame.up(high[1]));
      context.fillText(tidy(x), frame.across(x), frame.up(low[1]) + 6);
    }
    context.textAlign = "right";
    context.textBaseline = "middle";
    for (let y = Math.ceil(low[1] / step) * step; y <= high[1] + 1e-9; y += step) {
      line(context, frame.across(low[0]), frame.up(y), frame.across(high[0]), frame.up(y));
      context.fillText(tidy(y), frame.across(low[0]) - 6, frame.up(y));
    }
    context.strokeStyle = palette.faint;
    context.strokeRect(frame.across(low[0]), frame.up(high[1]), (high[0] - low[0]) * frame.scale, (high[1] - low[1]) * frame.scale);
  }

  function paintStill(context, frame, palette, state) {
    paintGrid(context, frame, palette);
    const none = [0, 0];
    model.data.regions.forEach((region, index) => {
      const turn = index % palette.region.length;
      paintShape(context, region, none, frame, palette.region[turn], palette.outline[turn], 0.85);
    });
    for (const obstacle of model.data.obstacles) {
      if (!obstacle.path && !obstacle.growth) paintShape(context, obstacle, none, frame, palette.obstacle, palette.obstacle, 0.9);
    }
    if (state.layers.paths) {
      for (const [name, motion] of Object.entries(model.motions)) {
        context.setLineDash(model.dash(name));
        for (let agent = 0; agent < model.agents; agent++) {
          context.globalAlpha = model.agents > 16 ? 0.22 : 0.4;
          context.strokeStyle = colourOf(palette, agent);
          context.lineWidth = 1;
          paintPath(context, frame, motion, agent, 0, motion.samples - 1);
        }
      }
      context.setLineDash([]);
      context.globalAlpha = 1;
    }
    context.textAlign = "center";
    context.textBaseline = "middle";
    context.font = "600 12px system-ui, sans-serif";
    if (!state.layers.names) return;
    for (const region of model.data.regions) label(context, region.name, frame.across(region.inner[0]), frame.up(region.inner[1]), palette.ink, palette.floor);
    for (const obstacle of model.data.obstacles) {
      if (!obstacle.path && !obstacle.growth) label(context, obstacle.name, frame.across(obstacle.inner[0]), frame.up(obstacle.inner[1]), palette.onObstacle, palette.obstacle);
    }
  }

  function paintPath(context, frame, motion, agent, first, last) {
    const x = agent * motion.samples;
    const y = (model.agents + agent) * motion.samples;
    context.beginPath();
    for (let sample = first; sample <= last; sample++) {
      context.lineTo(frame.across(motion.position[x + sample]), frame.up(motion.position[y + sample]));
    }
    context.stroke();
  }

  // Where an obstacle goes.
  function paintTrack(context, frame, palette, obstacle) {
    context.setLineDash([4, 3]);
    context.strokeStyle = palette.obstacle;
    context.beginPath();
    for (const time of [0, ...obstacle.path.times.filter((each) => each > 0 && each < model.horizon), model.horizon]) {
      const shift = model.shiftAt(obstacle, time);
      context.lineTo(frame.across(obstacle.inner[0] + shift[0]), frame.up(obstacle.inner[1] + shift[1]));
    }
    context.lineWidth = 1;
    context.stroke();
    context.setLineDash([]);
  }

  function paintMoving(context, frame, palette, state) {
    context.lineWidth = 1;
    context.textAlign = "center";
    context.textBaseline = "middle";
    context.font = "600 12px system-ui, sans-serif";
    for (const obstacle of model.data.obstacles) {
      if (!obstacle.path && !obstacle.growth) continue;
      if (obstacle.path) paintTrack(context, frame, palette, obstacle);
      const shift = model.shiftAt(obstacle, state.time);
      paintGrown(context, obstacle, shift, frame, palette.obstacle, model.grownAt(obstacle, state.time));
      paintShape(context, obstacle, shift, frame, palette.obstacle, palette.obstacle, 0.9);
      if (state.layers.names) label(context, obstacle.name, frame.across(obstacle.inner[0] + shift[0]), frame.up(obstacle.inner[1] + shift[1]), palette.onObstacle, palette.obstacle);
    }
    for (const beacon of model.data.beacons) {
      star(context, frame.across(beacon.position[0]), frame.up(beacon.position[1]), 7, palette);
      if (state.layers.names) label(context, beacon.name, frame.across(beacon.position[0]), frame.up(beacon.position[1]) - 14, palette.ink, palette.floor);
    }
  }

  function paintTrails(context, frame, palette, state) {
    const motion = model.motions[state.follow];
    const now = (state.time / model.data.step) * motion.rate;
    const first = Math.max(0, Math.floor(now - motion.samples * 0.25));
    context.lineCap = "round";
    for (let agent = 0; agent < model.agents; agent++) {
      const x = agent * motion.samples;
      const y = (model.agents + agent) * motion.samples;
      context.strokeStyle = colourOf(palette, agent);
      context.globalAlpha = state.focus >= 0 && state.focus !== agent ? 0.2 : 0.9;
      context.lineWidth = model.agents > 16 ? 1.4 : 2.4;
      context.beginPath();
      for (let sample = first; sample <= now; sample++) context.lineTo(frame.across(motion.position[x + sample]), frame.up(motion.position[y + sample]));
      const [atX, atY] = model.placeAt(motion, agent, state.time);
      context.lineTo(frame.across(atX), frame.up(atY));
      context.stroke();
    }
    context.globalAlpha = 1;
  }

  function draw(context, width, height, ratio, palette, state) {
    const frame = frameOf(width, height);
    const key = [width, height, ratio, palette.paper, state.layers.paths, state.layers.names].join();
    if (key !== stillKey) {
      still.width = width * ratio;
      still.height = height * ratio;
      const below = still.getContext("2d");
      below.setTransform(ratio, 0, 0, ratio, 0, 0);
      below.clearRect(0, 0, width, height);
      paintStill(below, frame, palette, state);
      stillKey = key;
    }
    context.drawImage(still, 0, 0, width, height);
    paintMoving(context, frame, palette, state);
    if (state.layers.trails) paintTrails(context, frame, palette, state);
    const places = Array.from({ length: model.agents }, (_, agent) => model.placeAt(model.motions[state.follow], agent, state.time));
    const points = places.map(([x, y]) => [frame.across(x), frame.up(y)]);
    const happening = happenings(model, state);
    paintLinks(context, points, happening, palette);
    points.forEach((point, agent) => paintAgent(context, point, model.data.agents[agent].radius * frame.scale, agent, palette, state, happening));
    if (model.agents <= 16 && state.layers.names) paintNames(context, points, palette, model, frame.scale);
    return points;
  }

  return { draw, turn: () => {}, zoom: () => {} };
}

function line(context, x0, y0, x1, y1) {
  context.beginPath();
  context.moveTo(x0, y0);
  context.lineTo(x1, y1);
  context.stroke();
}

function star(context, x, y, size, palette) {
  context.beginPath();
  for (let corner = 0; corner < 10; corner++) {
    const far = corner % 2 ? size * 0.45 : size;
    context.lineTo(x + far * Math.sin((corner * Math.PI) / 5), y - far * Math.cos((corner * Math.PI) / 5));
  }
  context.closePath();
  context.fillStyle = palette.floor;
  context.strokeStyle = palette.ink;
  context.lineWidth = 1.2;
  context.fill();
  context.stroke();
}

// Beyond the middle of a link that leads one way, towards its end.
function arrowhead(context, [x0, y0], [x1, y1], colour) {
  const long = Math.hypot(x1 - x0, y1 - y0);
  if (long < 16) return;
  const [along, across] = [(x1 - x0) / long, (y1 - y0) / long];
  const [x, y] = [x0 + 0.6 * (x1 - x0), y0 + 0.6 * (y1 - y0)];
  context.beginPath();
  context.moveTo(x + 6 * along, y + 6 * across);
  context.lineTo(x - 6 * along - 5 * across, y - 6 * across + 5 * along);
  context.lineTo(x - 6 * along + 5 * across, y - 6 * across - 5 * along);
  context.closePath();
  context.fillStyle = colour;
  context.fill();
}

// Links as they are, thicker at the step they appear, dashed at the step they break, with an arrowhead where they lead
// one way; the lit route and formation above.
function paintLinks(context, points, happening, palette) {
  const between = (first, second) => line(context, ...points[first], ...points[second]);
  for (const link of happening.links) {
    context.strokeStyle = palette.link;
    context.globalAlpha = link.kind === "gone" ? 0.5 : 0.75;
    context.lineWidth = link.kind === "new" ? 2.6 : 1.2;
    context.setLineDash(link.kind === "gone" ? [2, 5] : []);
    between(link.first, link.second);
    if (link.oneWay && link.kind !== "gone") arrowhead(context, points[link.first], points[link.second], palette.link);
  }
  context.setLineDash([]);
  context.globalAlpha = 1;
  for (const edge of happening.edges) {
    context.strokeStyle = edge.kept ? palette.holds : palette.fails;
    context.lineWidth = 3;
    context.setLineDash(edge.kept ? [] : [6, 4]);
    between(edge.first, edge.second);
  }
  context.setLineDash([]);
  for (const [first, second] of happening.route) {
    context.strokeStyle = palette.floor;
    context.lineWidth = 7;
    between(first, second);
    context.strokeStyle = palette.holds;
    context.lineWidth = 4;
    between(first, second);
  }
}

function paintAgent(context, [x, y], body, agent, palette, state, happening) {
  const colour = colourOf(palette, agent);
  const dim = state.focus >= 0 && state.focus !== agent;
  const lit = happening.lit(agent);
  const size = Math.max(body, points16(state.crowd));
  context.globalAlpha = dim ? 0.45 : 1;
  if (lit) {
    context.strokeStyle = lit === 1 ? palette.holds : palette.fails;
    context.lineWidth = 3;
    context.setLineDash(lit === 1 ? [] : [4, 3]);
    circle(context, x, y, size + 5);
    context.stroke();
    context.setLineDash([]);
  }
  context.fillStyle = colour;
  circle(context, x, y, size);
  context.globalAlpha = dim ? 0.2 : 0.9;
  context.fill();
  context.globalAlpha = 1;
  context.lineWidth = state.focus === agent ? 2.5 : 1.2;
  context.strokeStyle = state.focus === agent ? palette.ink : palette.floor;
  context.stroke();
}

const points16 = (crowd) => (crowd ? 3 : 5);

function circle(context, x, y, radius) {
  context.beginPath();
  context.arc(x, y, radius, 0, 2 * Math.PI);
}

// Names beside the bodies, those that would lie on another left out.
function paintNames(context, points, palette, model, scale) {
  context.font = "11px system-ui, sans-serif";
  context.textAlign = "left";
  context.textBaseline = "middle";
  const taken = [];
  points.forEach(([x, y], agent) => {
    const name = model.data.agents[agent].name;
    const left = x + Math.max(model.data.agents[agent].radius * scale, 5) + 5;
    const box = [left, y - 7, left + context.measureText(name).width, y + 7];
    const hidden = taken.some((other) => box[0] < other[2] && other[0] < box[2] && box[1] < other[3] && other[1] < box[3]);
    if (hidden) return;
    taken.push(box);
    label(context, name, left, y, palette.ink, palette.floor);
  });
}
