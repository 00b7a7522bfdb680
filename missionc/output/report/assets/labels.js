// Names that avoid each other: each takes the first of its places that is free, the one it had before that.
function labels() {
  const before = new Map();
  const widths = new Map();
  let taken = [];

  const free = (box) => !taken.some((other) => box[0] < other[2] && other[0] < box[2] && box[1] < other[3] && other[1] < box[3]);

  function width(context, text) {
    const key = `${context.font} ${text}`;
    if (!widths.has(key)) widths.set(key, context.measureText(text).width);
    return widths.get(key);
  }

  // Places around a point: beside it on all sides first, then further away.
  function around(x, y, room, wide) {
    const places = [];
    for (const far of [room + 3, room + 18, room + 36]) {
      for (const [right, down] of [[1, 0], [0.8, -0.75], [0.8, 0.75], [-1, 0], [-0.8, -0.75], [-0.8, 0.75], [0, -1], [0, 1]]) {
        const left = right > 0.1 ? x + right * far : right < -0.1 ? x + right * far - wide : x - wide / 2;
        places.push([left, y + down * (far + 5), far > room + 3]);
      }
    }
    return places;
  }

  return {
    // Names stay where they were while things move; what stands still is named anew, so that a picture is always the same.
    clear(moving) {
      taken = [];
      if (!moving) before.clear();
    },
    block: (x, y, size) => taken.push([x - size, y - size, x + size, y + size]),
    width,
    // Draws the text at one of the places ([left, middle, far]); of none that is free at the first, where it has to be.
    put(context, key, text, places, colour, halo, anchor = null, must = true) {
      const wide = width(context, text);
      const boxOf = ([left, middle]) => [left - 2, middle - 7, left + wide + 2, middle + 7];
      const last = before.get(key);
      const order = last !== undefined && last < places.length ? [last, ...places.keys()] : [...places.keys()];
      let chosen = order.find((place) => free(boxOf(places[place])));
      if (chosen === undefined && !must) return;
      chosen ??= 0;
      before.set(key, chosen);
      const [left, middle, far] = places[chosen];
      taken.push(boxOf(places[chosen]));
      if (far && anchor) {
        context.strokeStyle = colour;
        context.lineWidth = 0.7;
        const end = anchor[0] < left ? left - 1 : anchor[0] > left + wide ? left + wide + 1 : anchor[0];
        line(context, anchor[0], anchor[1], end, middle);
      }
      context.textAlign = "left";
      context.textBaseline = "middle";
      label(context, text, left, middle, colour, halo);
    },
    around,
  };
}
