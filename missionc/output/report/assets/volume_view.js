// A volume, seen from a camera that turns about its middle; parallel, so that lengths can be compared.
function volumeView(model) {
  const { low, high } = model.data.world;
  const middle = low.map((value, axis) => (value + high[axis]) / 2);
  const camera = { turn: -0.7, tilt: 0.55, zoom: 1 };

  function lens(width, height) {
    const reach = Math.hypot(...high.map((value, axis) => value - low[axis]));
    const scale = (camera.zoom * Math.min(width * 1.1, height * 1.18)) / reach;
    const [sine, cosine] = [Math.sin(camera.turn), Math.cos(camera.turn)];
    const [rise, flat] = [Math.sin(camera.tilt), Math.cos(camera.tilt)];
    const project = (x, y, z) => {
      const across = (x - middle[0]) * cosine - (y - middle[1]) * sine;
      const away = (x - middle[0]) * sine + (y - middle[1]) * cosine;
      const up = z - middle[2];
      return [width / 2 + across * scale, height / 2 - (up * flat + away * rise) * scale, away * flat - up * rise];
    };
    return { project, scale };
  }

  function polygon(context, points) {
    context.beginPath();
    for (const point of points) context.lineTo(point[0], point[1]);
    context.closePath();
  }

  function paintFloor(context, project, palette) {
    const corners = [[low[0], low[1]], [high[0], low[1]], [high[0], high[1]], [low[0], high[1]]];
    polygon(context, corners.map(([x, y]) => project(x, y, low[2])));
    context.fillStyle = palette.floor;
    context.fill();
    context.strokeStyle = palette.grid;
    context.lineWidth = 1;
    const step = pleasant(Math.max(high[0] - low[0], high[1] - low[1]), 10);
    const segment = (from, to) => line(context, ...project(...from).slice(0, 2), ...project(...to).slice(0, 2));
    for (let x = Math.ceil(low[0] / step) * step; x <= high[0] + 1e-9; x += step) segment([x, low[1], low[2]], [x, high[1], low[2]]);
    for (let y = Math.ceil(low[1] / step) * step; y <= high[1] + 1e-9; y += step) segment([low[0], y, low[2]], [high[0], y, low[2]]);
    context.strokeStyle = palette.faint;
    context.globalAlpha = 0.5;
    corners.forEach(([x, y], corner) => {
      const [nextX, nextY] = corners[(corner + 1) % 4];
      segment([x, y, low[2]], [nextX, nextY, low[2]]);
      segment([x, y, high[2]], [nextX, nextY, high[2]]);
      segment([x, y, low[2]], [x, y, high[2]]);
    });
    context.globalAlpha = 1;
    context.font = "11px system-ui, sans-serif";
    context.fillStyle = palette.faint;
    context.textAlign = "center";
    context.textBaseline = "middle";
    const tag = (text, x, y, z) => context.fillText(text, ...project(x, y, z).slice(0, 2));
    const out = 0.05 * Math.max(high[0] - low[0], high[1] - low[1]);
    tag(`x ${high[0]} m`, high[0], low[1] - out, low[2]);
    tag(`y ${high[1]} m`, low[0] - out, high[1], low[2]);
    tag(`z ${high[2]} m`, low[0] - out, low[1] - out, high[2]);
  }

  function ringOf(part) {
    if (part.rings) return part.rings;
    const [x, y, radius] = part.disc;
    return [Array.from({ length: 40 }, (_, corner) => [x + radius * Math.cos((corner * Math.PI) / 20), y + radius * Math.sin((corner * Math.PI) / 20)])];
  }

  function paintSolid(context, project, scale, part, shift, fill, stroke, alpha, grown) {
    context.fillStyle = fill;
    context.strokeStyle = stroke;
    context.lineWidth = 1;
    if (part.ball) {
      const [x, y, z, radius] = part.ball;
      const [left, top] = project(x + shift[0], y + shift[1], z + shift[2]);
      context.globalAlpha = alpha * 1.6;
      circle(context, left, top, radius * scale);
      context.fill();
      context.globalAlpha = 0.8;
      context.stroke();
      if (grown) {
        circle(context, left, top, (radius + grown) * scale);
        context.globalAlpha = alpha * 0.6;
        context.fill();
      }
      context.globalAlpha = 1;
      return;
    }
    const faces = [];
    for (const ring of ringOf(part)) {
      const at = (height) => ring.map(([x, y]) => project(x + shift[0], y + shift[1], height + (shift[2] || 0)));
      const [bottom, top] = [at(part.low), at(part.high)];
      faces.push(bottom, top, ...ring.map((_, corner) => {
        const next = (corner + 1) % ring.length;
        return [bottom[corner], bottom[next], top[next], top[corner]];
      }));
      context.globalAlpha = 0.8;
      for (const cap of [bottom, top]) {
        polygon(context, cap);
        context.stroke();
      }
      if (ring.length <= 12) ring.forEach((_, corner) => line(context, bottom[corner][0], bottom[corner][1], top[corner][0], top[corner][1]));
    }
    if (grown) {
      // Seen in parallel, all places within some metres of a solid are those within as many of its picture.
      context.beginPath();
      for (const face of faces) {
        face.forEach(([x, y], corner) => (corner ? context.lineTo(x, y) : context.moveTo(x, y)));
        context.closePath();
      }
      context.lineWidth = 2 * grown * scale;
      context.lineJoin = "round";
      context.globalAlpha = alpha * 0.6;
      context.stroke();
      context.lineWidth = 1;
    }
    context.globalAlpha = alpha;
    const depth = (face) => face.reduce((sum, point) => sum + point[2], 0) / face.length;
    for (const face of faces.sort((one, other) => depth(other) - depth(one))) {
      polygon(context, face);
      context.fill();
    }
    context.globalAlpha = 1;
  }

  function paintSolids(context, project, scale, palette, state) {
    const none = [0, 0, 0];
    const all = [];
    model.data.regions.forEach((shape, index) => {
      const turn = index % palette.region.length;
      all.push({ shape, shift: none, grown: 0, fill: palette.outline[turn], stroke: palette.outline[turn], alpha: 0.16, ink: palette.ink });
    });
    for (const shape of model.data.obstacles) {
      all.push({ shape, shift: model.shiftAt(shape, state.time), grown: model.grownAt(shape, state.time), fill: palette.obstacle, stroke: palette.obstacle, alpha: 0.3, ink: palette.ink });
    }
    const depth = (each) => project(each.shape.inner[0] + each.shift[0], each.shape.inner[1] + each.shift[1], middle[2])[2];
    for (const each of all.sort((one, other) => depth(other) - depth(one))) {
      for (const part of each.shape.parts) paintSolid(context, project, scale, part, each.shift, each.fill, each.stroke, each.alpha, each.grown);
    }
    if (!state.layers.names) return;
    context.font = "600 12px system-ui, sans-serif";
    context.textAlign = "center";
    for (const each of all) {
      const top = Math.max(...each.shape.parts.map((part) => (part.ball ? part.ball[2] + part.ball[3] : part.high)), low[2]);
      const [x, y] = project(each.shape.inner[0] + each.shift[0], each.shape.inner[1] + each.shift[1], top + (each.shift[2] || 0));
      label(context, each.shape.name, x, y - 8, each.ink, palette.paper);
    }
  }

  function paintPaths(context, project, palette, state) {
    const stroke = (motion, agent, first, last) => {
      const start = (axis) => (axis * model.agents + agent) * motion.samples;
      context.beginPath();
      for (let sample = first; sample <= last; sample++) {
        const [x, y] = project(motion.position[start(0) + sample], motion.position[start(1) + sample], motion.position[start(2) + sample]);
        context.lineTo(x, y);
      }
      context.stroke();
    };
    for (const [name, motion] of Object.entries(model.motions)) {
      const now = Math.floor((state.time / model.data.step) * motion.rate);
      for (let agent = 0; agent < model.agents; agent++) {
        context.strokeStyle = colourOf(palette, agent);
        if (state.layers.paths) {
          context.globalAlpha = 0.35;
          context.lineWidth = 1;
          context.setLineDash(model.dash(name));
          stroke(motion, agent, 0, motion.samples - 1);
          context.setLineDash([]);
        }
        if (state.layers.trails && name === state.follow) {
          context.globalAlpha = state.focus >= 0 && state.focus !== agent ? 0.2 : 0.9;
          context.lineWidth = 2.2;
          stroke(motion, agent, Math.max(0, now - Math.floor(motion.samples * 0.25)), now);
        }
      }
    }
    context.globalAlpha = 1;
  }

  function draw(context, width, height, ratio, palette, state) {
    const { project, scale } = lens(width, height);
    paintFloor(context, project, palette);
    paintSolids(context, project, scale, palette, state);
    for (const beacon of model.data.beacons) {
      const [x, y] = project(...beacon.position);
      star(context, x, y, 7, palette);
    }
    paintPaths(context, project, palette, state);
    const places = Array.from({ length: model.agents }, (_, agent) => model.placeAt(model.motions[state.follow], agent, state.time));
    const points = places.map((place) => project(...place));
    context.strokeStyle = palette.faint;
    context.setLineDash([1, 3]);
    places.forEach(([x, y], agent) => {
      const [footX, footY] = project(x, y, low[2]);
      line(context, points[agent][0], points[agent][1], footX, footY);
    });
    context.setLineDash([]);
    const happening = happenings(model, state);
    paintLinks(context, points.map((point) => point.slice(0, 2)), happening, palette);
    const order = points.map((_, agent) => agent).sort((one, other) => points[other][2] - points[one][2]);
    for (const agent of order) paintAgent(context, points[agent], model.data.agents[agent].radius * scale, agent, palette, state, happening);
    if (model.agents <= 16 && state.layers.names) paintNames(context, points, palette, model, scale);
    return points;
  }

  return {
    draw,
    turn(across, up) {
      camera.turn += across;
      camera.tilt = Math.min(Math.PI / 2, Math.max(0.02, camera.tilt + up));
    },
    zoom(times) {
      camera.zoom = Math.min(6, Math.max(0.4, camera.zoom * times));
    },
  };
}
