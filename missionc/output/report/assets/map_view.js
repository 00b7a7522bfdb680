// The map: `mapView(canvas, model)` draws the world at a time through a camera of its own, or one that is shared.
//
//   setWorld(model)            another world, or the same one with another motion
//   draw(palette, state)       what `state` asks for: see `shownFirst`
//   paint(context, width, height, palette, state)   the same on any context
//   camera                     get, set, fit, slant, pan, zoom, turn (camera.js)
//   agentAt(px, py, reach), placeAt(px, py), pointOf(place)   between the picture and the world
function mapView(canvas, first, shared = null) {
  const still = document.createElement("canvas");
  const names = labels();
  let model = first;
  let eye = shared || camera(model.low, model.high);
  let happening = happenings(model);
  let drawn = { key: "" };
  let points = [];

  const size = () => [canvas.clientWidth, canvas.clientHeight];
  const frameNow = () => eye.frame(...size());

  // What stands still is drawn with room around it, and moved while the camera only pans.
  function paintStill(ratio, frame, palette, state) {
    const [width, height] = [frame.width, frame.height];
    const room = Math.round(Math.min(width, height) * 0.3);
    const key = [width, height, ratio, palette.paper, state.layers.paths, eye.own.turn, eye.own.tilt, frame.scale].join();
    let [right, down] = [frame.ox - drawn.ox, frame.oy - drawn.oy];
    if (key !== drawn.key || Math.abs(right) > room || Math.abs(down) > room) {
      still.width = (width + 2 * room) * ratio;
      still.height = (height + 2 * room) * ratio;
      const below = still.getContext("2d");
      below.setTransform(ratio, 0, 0, ratio, room * ratio, room * ratio);
      paintStanding(below, { ...frame }, model, palette);
      if (state.layers.paths) {
        paintPaths(below, frame, model, palette);
        paintWays(below, frame, model, palette);
        paintPast(below, frame, model, palette);
      }
      drawn = { key, ox: frame.ox, oy: frame.oy, room };
      [right, down] = [0, 0];
    }
    return [right - room, down - room, width + 2 * room, height + 2 * room];
  }

  function draw(palette, state, ghost = null) {
    const ratio = window.devicePixelRatio || 1;
    const [width, height] = size();
    if (!width || !height) return;
    if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
      canvas.width = Math.round(width * ratio);
      canvas.height = Math.round(height * ratio);
    }
    const context = canvas.getContext("2d");
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    chase(state);
    const frame = eye.frame(width, height);
    const grid = ground(context, frame, palette);
    context.drawImage(still, ...paintStill(ratio, frame, palette, state));
    paintScale(context, frame, model, palette, grid);
    paintMoving(context, frame, palette, state, ghost);
  }

  function paint(context, width, height, palette, state, ghost = null) {
    const frame = eye.frame(width, height);
    const grid = ground(context, frame, palette);
    paintStanding(context, frame, model, palette);
    if (state.layers.paths) {
      paintPaths(context, frame, model, palette);
      paintWays(context, frame, model, palette);
      paintPast(context, frame, model, palette);
    }
    paintScale(context, frame, model, palette, grid);
    paintMoving(context, frame, palette, state, ghost);
  }

  function ground(context, frame, palette) {
    context.globalAlpha = 1;
    context.fillStyle = palette.paper;
    context.fillRect(0, 0, frame.width, frame.height);
    return paintFloor(context, frame, model, palette);
  }

  const motionOf = (of, state) => of.motions[state.motion] || of.motions.planned;

  // The agent that is followed stays where it is in the picture.
  function chase(state) {
    if (state.followed < 0 || state.followed >= model.agents) return;
    eye.own.target = model.placeAt(motionOf(model, state), state.followed, state.time);
  }

  function paintMoving(context, frame, palette, state, ghost) {
    paintObstacles(context, frame, model, palette, state.time);
    for (const beacon of model.data.beacons) star(context, ...frame.point(beacon.position), 7, palette);
    if (ghost) paintTeam(context, frame, ghost, palette, { ...state, shown: null, graph: "" }, null, true);
    points = paintTeam(context, frame, model, palette, state, happening(state), false);
    paintNames(context, frame, palette, state);
    if (state.ruler) paintRuler(context, frame, palette, state);
  }

  function paintTeam(context, frame, of, palette, state, seen, ghost) {
    const motion = motionOf(of, state);
    const places = Array.from({ length: of.agents }, (_, agent) => of.placeAt(motion, agent, state.time));
    const spots = places.map(frame.point);
    if (state.trail > 0) paintTrails(context, frame, of, palette, state, spots, ghost);
    if (of.dimension === 3 && !frame.flat) {
      // Down to the floor, so that a place in the picture is one in the world.
      context.strokeStyle = palette.faint;
      context.lineWidth = 1;
      context.setLineDash([1, 3]);
      context.beginPath();
      places.forEach(([x, y], agent) => {
        context.moveTo(...spots[agent]);
        context.lineTo(...frame.point([x, y, of.low[2]]));
      });
      context.stroke();
      context.setLineDash([]);
    }
    if (seen) paintLinks(context, spots, seen, palette);
    const order = spots.map((_, agent) => agent);
    if (!frame.flat) order.sort((one, other) => frame.depth(places[other]) - frame.depth(places[one]));
    for (const agent of order) if (frame.sees(...spots[agent])) paintAgent(context, spots[agent], agent, frame, of, palette, state, seen ? seen.lit(agent) : 0, ghost);
    return spots;
  }

  // Of a crowd, the names of those that are pointed at, chosen or followed; of many obstacles, of those that are wide enough.
  function paintNames(context, frame, palette, state) {
    names.clear(state.playing || state.recording);
    if (!model.crowd) for (const [x, y] of points) names.block(x, y, 6);
    context.font = "600 12px system-ui, sans-serif";
    if (state.layers.names) {
      for (const region of model.data.regions) if (isThere(region, state.time)) paintShapeName(context, frame, palette, state, region);
      model.data.obstacles.forEach((obstacle, index) => {
        if (!isThere(obstacle, state.time)) return;
        if (!model.crowded || index === state.pointedObstacle || holdsItsName(context, frame, obstacle)) paintShapeName(context, frame, palette, state, obstacle);
      });
    }
    context.font = "11px system-ui, sans-serif";
    if (state.layers.names) for (const beacon of model.data.beacons) nameAt(context, `beacon ${beacon.name}`, beacon.name, frame.point(beacon.position), 8, palette);
    const named = model.crowd || !state.layers.names ? [...new Set([state.pointed, state.focus, state.followed])].filter((agent) => agent >= 0 && agent < model.agents) : points.keys();
    for (const agent of named) {
      if (!frame.sees(...points[agent], 0)) continue;
      nameAt(context, `agent ${agent}`, model.data.agents[agent].name, points[agent], Math.min(Math.max(model.data.agents[agent].radius * frame.scale, 5), 30), palette);
    }
    if (!state.layers.names) return;
    for (const edge of happening(state).edges) {
      if (!edge.name) continue;
      const [from, to] = [points[edge.first], points[edge.second]];
      nameAt(context, `formation ${edge.name}`, edge.name, [(from[0] + to[0]) / 2, (from[1] + to[1]) / 2], 2, palette, palette.faint);
    }
  }

  const holdsItsName = (context, frame, shape) => {
    const [left, right] = extent(shape, 0);
    return names.width(context, shape.name) < (right - left) * frame.scale;
  };

  function nameAt(context, key, text, [x, y], room, palette, colour = palette.ink) {
    names.put(context, key, text, names.around(x, y, room, names.width(context, text)), colour, palette.floor, [x, y]);
  }

  function paintShapeName(context, frame, palette, state, shape) {
    if (!shape.parts.length) return;
    const look = lookOf(palette, shape, !frame.flat);
    const shift = shape.role ? [0, 0, 0] : model.shiftAt(shape, state.time);
    const solid = !frame.flat && model.dimension === 3;
    const top = solid ? Math.max(model.low[2], ...shape.parts.map((part) => (part.ball ? part.ball[2] + part.ball[3] : (part.high ?? 0)))) : 0;
    const [x, y] = frame.point([shape.inner[0] + shift[0], shape.inner[1] + shift[1], top + shift[2]]);
    if (!frame.sees(x, y, 60)) return;
    const wide = names.width(context, shape.name);
    const middle = x - wide / 2;
    const above = solid ? [[middle, y - 9]] : [];
    const places = [...above, [middle, y], [middle, y - 16], [middle, y + 16], [middle, y - 32], [middle, y + 32], [x + 12, y], [x - wide - 12, y]];
    const [ink, halo] = solid ? [palette.ink, palette.paper] : [look.ink, look.halo];
    names.put(context, `shape ${shape.name}`, shape.name, places, ink, halo, null);
  }

  // Between two places, or agents, which take it along.
  function paintRuler(context, frame, palette, state) {
    const placeOf = (end) => (end.agent === undefined ? end.place : model.placeAt(motionOf(model, state), end.agent, state.time));
    const [from, to] = state.ruler.map(placeOf);
    const [start, end] = [frame.point(from), frame.point(to)];
    context.setLineDash([]);
    for (const [colour, wide] of [[palette.floor, 5], [palette.ink, 1.6]]) {
      Object.assign(context, { strokeStyle: colour, fillStyle: colour, lineWidth: wide });
      line(context, ...start, ...end);
      for (const [x, y] of [start, end]) {
        circle(context, x, y, wide + 1);
        context.fill();
      }
    }
    const long = Math.hypot(...from.map((value, axis) => value - to[axis]));
    const bodies = state.ruler.every((each) => each.agent !== undefined) ? long - state.ruler.reduce((sum, each) => sum + model.data.agents[each.agent].radius, 0) : null;
    context.font = "600 12px system-ui, sans-serif";
    const text = `${short(long)} m${bodies === null ? "" : `, ${short(bodies)} m between bodies`}`;
    nameAt(context, "ruler", text, [(start[0] + end[0]) / 2, (start[1] + end[1]) / 2], 4, palette);
  }

  return {
    draw,
    paint,
    canvas,
    size,
    get camera() {
      return eye;
    },
    get model() {
      return model;
    },
    setWorld(next) {
      const same = String([model.low, model.high]) === String([next.low, next.high]);
      model = next;
      happening = happenings(model);
      drawn = { key: "" };
      if (!same && !shared) eye = camera(model.low, model.high);
    },
    agentAt(px, py, reach = 18) {
      let [best, least] = [-1, reach];
      points.forEach(([x, y], agent) => {
        const distance = Math.hypot(px - x, py - y);
        if (distance < least) [best, least] = [agent, distance];
      });
      return best;
    },
    // The obstacle that a place of the picture shows, from above; -1 for none.
    obstacleAt(px, py, time) {
      const [x, y] = frameNow().place(px, py);
      return model.data.obstacles.findLastIndex((obstacle) => {
        const [across, up] = model.shiftAt(obstacle, time);
        return isThere(obstacle, time) && covers(obstacle, x - across, y - up);
      });
    },
    placeAt: (px, py) => frameNow().place(px, py),
    pointOf: (place) => frameNow().point(place),
  };
}
