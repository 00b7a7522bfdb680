// Pointer, wheel and keys on a map: what they do to its camera, and whom they choose.
function gestures(view, state, change) {
  const { canvas } = view;
  const pointers = new Map();
  let dragged = null;

  const at = (event) => {
    const box = canvas.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  };
  const turns = (event) => view.camera.slanted() && !event.shiftKey && event.button !== 1;
  // A picture that is moved by hand is no longer moved by who was followed.
  const moved = () => change({ followed: -1, looked: true });

  function pinch(event) {
    const before = [...pointers.values()];
    pointers.set(event.pointerId, at(event));
    const after = [...pointers.values()];
    const apart = ([[x, y], [u, v]]) => Math.hypot(x - u, y - v) || 1;
    const middle = ([[x, y], [u, v]]) => [(x + u) / 2, (y + v) / 2];
    const [from, to] = [middle(before), middle(after)];
    view.camera.pan(...view.size(), to[0] - from[0], to[1] - from[1]);
    view.camera.zoom(...view.size(), apart(after) / apart(before), ...to);
    moved();
  }

  // An end of the ruler: the agent below the pointer, or the place.
  const endAt = ([px, py]) => {
    const agent = view.agentAt(px, py, 14);
    return agent >= 0 ? { agent } : { place: view.placeAt(px, py) };
  };

  canvas.addEventListener("pointerdown", (event) => {
    pointers.set(event.pointerId, at(event));
    try {
      canvas.setPointerCapture(event.pointerId);
    } catch {
      // A pointer that is gone already.
    }
    if (pointers.size === 1) dragged = { from: at(event), last: at(event), moved: false, turning: turns(event) };
    else dragged = null;
  });

  canvas.addEventListener("pointermove", (event) => {
    const [px, py] = at(event);
    if (pointers.size === 2 && pointers.has(event.pointerId)) return pinch(event);
    if (!dragged) {
      const agent = view.agentAt(px, py);
      canvas.style.cursor = state.measuring ? "crosshair" : agent >= 0 ? "pointer" : "grab";
      const obstacle = agent >= 0 ? -1 : view.obstacleAt(px, py, state.time);
      if (agent !== state.pointed || obstacle !== state.pointedObstacle) change({ pointed: agent, pointedObstacle: obstacle });
      return;
    }
    const [right, down] = [px - dragged.last[0], py - dragged.last[1]];
    if (!dragged.moved && Math.hypot(px - dragged.from[0], py - dragged.from[1]) < 4) return;
    dragged.moved = true;
    dragged.last = [px, py];
    if (state.measuring) return change({ ruler: [dragged.end ?? (dragged.end = endAt(dragged.from)), endAt([px, py])] });
    if (dragged.turning) view.camera.turn(...view.size(), -right * 0.01, down * 0.01);
    else view.camera.pan(...view.size(), right, down);
    if (dragged.turning) change({ looked: true });
    else moved();
  });

  const release = (event) => {
    pointers.delete(event.pointerId);
    if (dragged && !dragged.moved && event.type === "pointerup") {
      const agent = view.agentAt(...dragged.from);
      if (!state.measuring) change({ focus: agent === state.focus ? -1 : agent });
      else change({ ruler: null });
    }
    dragged = null;
  };
  canvas.addEventListener("pointerup", release);
  canvas.addEventListener("pointercancel", release);
  canvas.addEventListener("pointerleave", () => (state.pointed >= 0 || state.pointedObstacle >= 0) && change({ pointed: -1, pointedObstacle: -1 }));

  canvas.addEventListener("dblclick", (event) => {
    const agent = view.agentAt(...at(event));
    if (agent >= 0) change({ focus: agent, followed: agent });
    else {
      view.camera.zoom(...view.size(), 1.8, ...at(event));
      change({ looked: true });
    }
  });

  canvas.addEventListener(
    "wheel",
    (event) => {
      event.preventDefault();
      const pixels = event.deltaY * (event.deltaMode === 1 ? 16 : 1);
      // A pinch on a touchpad comes as a wheel with this key.
      const times = Math.exp(-pixels * (event.ctrlKey ? 0.01 : 0.0015));
      const centre = state.followed >= 0 ? [] : at(event);
      view.camera.zoom(...view.size(), times, ...centre);
      change({ looked: true });
    },
    { passive: false },
  );

  canvas.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const [width, height] = view.size();
    const pan = { a: [40, 0], d: [-40, 0], w: [0, 40], s: [0, -40] }[event.key];
    const turn = { a: [0.1, 0], d: [-0.1, 0], w: [0, 0.1], s: [0, -0.1] }[event.key];
    if (turn && view.camera.slanted()) view.camera.turn(width, height, ...turn);
    else if (pan) view.camera.pan(width, height, ...pan);
    else if (event.key === "+" || event.key === "=" || event.key === "-") view.camera.zoom(width, height, event.key === "-" ? 1 / 1.2 : 1.2);
    else if (event.key === "0") view.camera.fit();
    else return;
    event.preventDefault();
    if (pan && !view.camera.slanted()) moved();
    else change({ looked: true });
  });
}
