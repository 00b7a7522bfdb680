// Drawing of the map: a thing or a handle as an element of SVG.
export const SVG = "http://www.w3.org/2000/svg";

export function element(name, attributes = {}, ...children) {
  const made = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) if (value !== undefined) made.setAttribute(key, value);
  made.append(...children);
  return made;
}

export function titled(made, words) {
  made.prepend(element("title", {}, words));
  return made;
}

const ring = (frame, points) => `M${points.map(([x, y]) => `${frame.x(x).toFixed(2)},${frame.y(y).toFixed(2)}`).join("L")}Z`;

function round(frame, [x, y], radius) {
  const [a, b, r] = [frame.x(x), frame.y(y), radius * frame.scale].map((value) => value.toFixed(2));
  return `M${a},${b}m-${r},0a${r},${r} 0 1 0 ${2 * r},0a${r},${r} 0 1 0 -${2 * r},0Z`;
}

// The outline of filled parts, as the report has them.
export const partsPath = (frame, parts) =>
  parts.map(({ rings, disc, ball }) => (rings ? rings.map((points) => ring(frame, points)).join("") : round(frame, disc ?? ball, (disc ?? ball).at(-1)))).join("");

// How wide filled parts are, metres.
export function partsWidth(parts) {
  const ends = parts.flatMap(({ rings, disc, ball }) => (rings ? rings.flat().map(([x]) => x) : [-1, 1].map((side) => (disc ?? ball)[0] + side * (disc ?? ball).at(-1))));
  return Math.max(...ends) - Math.min(...ends);
}

// How wide a name is as the map writes it, pixels.
const paper = document.createElement("canvas").getContext("2d");
export function nameWidth(name) {
  paper.font = "12px system-ui, sans-serif";
  return paper.measureText(name).width;
}

// The outline of a piece, from its numbers as they are just now.
export function piecePath(frame, { form, points, radius }) {
  const at = points.map(([x, y]) => [x.metres, y.metres]);
  if (form === "disc") return round(frame, at[0], radius.metres);
  if (form === "box") {
    const [[a, b], [c, d]] = at;
    return ring(frame, [[a, b], [c, b], [c, d], [a, d]]);
  }
  if (form === "polygon" || form === "line") return ring(frame, at);
  return "";
}

// Lines of the grid, with their metres at the border.
export function gridLines(frame, { low, high }) {
  const group = element("g", { class: "grid" });
  const step = frame.lines();
  const decimals = Math.max(0, Math.ceil(-Math.log10(step) - 1e-9));
  const along = (from, to) => {
    const found = [];
    for (let value = Math.ceil(from / step - 1e-9); value * step <= to + step * 1e-9; value++) found.push(value * step);
    return found;
  };
  const edge = { left: frame.x(low[0]), right: frame.x(high[0]), top: frame.y(high[1]), bottom: frame.y(low[1]) };
  for (const x of along(low[0], high[0])) {
    group.append(element("path", { d: `M${frame.x(x)},${edge.top}V${edge.bottom}` }));
    group.append(element("text", { x: frame.x(x), y: edge.bottom + 15, "text-anchor": "middle" }, x.toFixed(decimals)));
  }
  for (const y of along(low[1], high[1])) {
    group.append(element("path", { d: `M${edge.left},${frame.y(y)}H${edge.right}` }));
    group.append(element("text", { x: edge.left - 6, y: frame.y(y) + 4, "text-anchor": "end" }, y.toFixed(decimals)));
  }
  return group;
}
