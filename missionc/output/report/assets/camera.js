// A camera that looks at the world in parallel, so that lengths can be compared: from above it is a map. The projection
// is affine: `frame` gives its numbers for a size of the picture.
const ABOVE = Math.PI / 2;
const SLANTED = { turn: -0.6, tilt: 0.6 };
const EDGE = { left: 38, right: 16, top: 16, bottom: 30 };
const ZOOM = { least: 0.2, most: 400 };

function camera(low, high) {
  const middle = low.map((value, axis) => (value + high[axis]) / 2);
  const own = { turn: 0, tilt: ABOVE, zoom: 1, target: [...middle] };

  const axes = () => {
    const [sine, cosine, rise, flat] = [Math.sin(own.turn), Math.cos(own.turn), Math.sin(own.tilt), Math.cos(own.tilt)];
    return { across: [cosine, -sine, 0], up: [rise * sine, rise * cosine, flat], away: [flat * sine, flat * cosine, -rise], rise };
  };

  // Pixels for a metre at which the whole world just fits.
  function fitting(width, height, { across, up }) {
    const span = (axis) => axis.reduce((sum, value, at) => sum + Math.abs(value) * (high[at] - low[at]), 0) || 1;
    return Math.max(1e-6, Math.min((width - EDGE.left - EDGE.right) / span(across), (height - EDGE.top - EDGE.bottom) / span(up)));
  }

  function frame(width, height) {
    const { across, up, away, rise } = axes();
    const scale = fitting(width, height, { across, up }) * own.zoom;
    const [ax, bx] = [across[0] * scale, across[1] * scale];
    const [ay, by, cy] = [-up[0] * scale, -up[1] * scale, -up[2] * scale];
    const ox = (width + EDGE.left - EDGE.right) / 2 - ax * own.target[0] - bx * own.target[1];
    const oy = (height + EDGE.top - EDGE.bottom) / 2 - ay * own.target[0] - by * own.target[1] - cy * own.target[2];
    return {
      width, height, scale, rise, ax, bx, ox, ay, by, cy, oy,
      flat: rise > 0.999,
      x: (x, y) => ox + ax * x + bx * y,
      y: (x, y, z) => oy + ay * x + by * y + cy * z,
      point: ([x, y, z = 0]) => [ox + ax * x + bx * y, oy + ay * x + by * y + cy * z],
      depth: ([x, y, z = 0]) => away[0] * x + away[1] * y + away[2] * z,
      // The place at a height that a pixel shows.
      place(px, py, z = low[2]) {
        const [right, down] = [px - ox, py - oy - cy * z];
        const size = ax * by - bx * ay || 1e-12;
        return [(right * by - bx * down) / size, (ax * down - right * ay) / size, z];
      },
      sees: (px, py, margin = 40) => px > -margin && py > -margin && px < width + margin && py < height + margin,
    };
  }

  // Everything that is moved keeps what is below the pointer there.
  return {
    own,
    frame,
    get: () => ({ ...own, target: [...own.target] }),
    set(next) {
      Object.assign(own, next);
      own.tilt = Math.min(ABOVE, Math.max(0.05, own.tilt));
      own.zoom = Math.min(ZOOM.most, Math.max(ZOOM.least, own.zoom));
    },
    fit() {
      Object.assign(own, { zoom: 1, target: [...middle] });
    },
    slant: (slanted) => Object.assign(own, slanted ? SLANTED : { turn: 0, tilt: ABOVE }, { zoom: 1, target: [...middle] }),
    slanted: () => own.tilt < ABOVE - 0.01,
    pan(width, height, right, down) {
      const shown = frame(width, height);
      const [from, to] = [shown.place(0, 0), shown.place(right, down)];
      own.target = own.target.map((value, axis) => value + from[axis] - to[axis]);
    },
    zoom(width, height, times, px = width / 2, py = height / 2) {
      const before = frame(width, height).place(px, py);
      own.zoom = Math.min(ZOOM.most, Math.max(ZOOM.least, own.zoom * times));
      const after = frame(width, height).place(px, py);
      own.target = own.target.map((value, axis) => value + before[axis] - after[axis]);
    },
    turn(width, height, right, up) {
      const before = fitting(width, height, axes());
      own.turn += right;
      own.tilt = Math.min(ABOVE, Math.max(0.05, own.tilt + up));
      own.zoom *= before / fitting(width, height, axes());
    },
  };
}
