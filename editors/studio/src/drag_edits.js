// From a drag to edits of the text: which numbers change, by how much, and how they are written.

// A step that people like, near so many metres: 1, 2 or 5 times a power of ten.
export function pleasant(rough) {
  const power = 10 ** Math.floor(Math.log10(rough));
  return [1, 2, 5, 10].map((times) => times * power).find((step) => step >= rough * (1 - 1e-9));
}

export const snap = (metres, grid) => Math.round(metres / grid) * grid;

// A number as its author would write it: in the same unit, with as many decimals as it had, or as the grid needs.
export function written(number, metres, grid) {
  const value = metres / number.unit;
  const step = grid / number.unit;
  const decimals = Math.min(9, Math.max(0, Math.ceil(-Math.log10(step) - 1e-9)));
  let text = value.toFixed(Math.max(number.decimals, decimals));
  while (text.includes(".") && decimalsOf(text) > number.decimals && text.endsWith("0")) text = text.slice(0, -1);
  text = text.replace(/\.$/, "");
  return /^-0(\.0*)?$/.test(text) ? text.slice(1) : text;
}

const decimalsOf = (text) => text.length - text.indexOf(".") - 1;

// What a handle moves: for each number that follows it, which one, and along which axis (0 across, 1 up).
export function handles(piece) {
  const { form, points } = piece;
  const whole = { name: "move", at: middle(piece), follows: points.flatMap((point) => [[point[0], 0], [point[1], 1]]) };
  if (form === "point") return [whole];
  if (form === "disc") {
    const [[x, y]] = points;
    const at = [x.metres + piece.radius.metres, y.metres];
    return [whole, { name: "radius", at, follows: [[piece.radius, 0]], least: 0 }];
  }
  if (form === "box") {
    const [low, high] = points;
    const corners = [[low, low], [high, low], [high, high], [low, high]];
    return [whole, ...corners.map(([across, up]) => corner(across[0], up[1]))];
  }
  return [whole, ...points.map(([x, y]) => corner(x, y))];
}

const corner = (x, y) => ({ name: "corner", at: [x.metres, y.metres], follows: [[x, 0], [y, 1]] });

function middle({ points }) {
  const mean = (axis) => points.reduce((sum, point) => sum + point[axis].metres, 0) / points.length;
  return [mean(0), mean(1)];
}

// Why a handle cannot be dragged along an axis; empty where it can.
export const fixedAlong = (handle, axis) => handle.follows.find(([number, along]) => along === axis && number.fixed)?.[0].fixed ?? "";

export function whyFixed(handle) {
  const axes = [0, 1].filter((axis) => handle.follows.some(([, along]) => along === axis));
  const reasons = axes.map((axis) => fixedAlong(handle, axis));
  return reasons.every(Boolean) ? reasons[0] : "";
}

// The new metres of each number that follows a handle, which was dragged by so many metres from where they began.
export function moved(handle, begun, [across, up], grid) {
  const shift = [across, up].map((metres, axis) => (fixedAlong(handle, axis) ? 0 : metres));
  const alone = handle.name !== "move";
  return handle.follows.map(([number, axis], index) => {
    if (!shift[axis]) return [number, begun[index]];
    const to = alone ? snap(begun[index] + shift[axis], grid) : begun[index] + snap(shift[axis], grid);
    return [number, handle.least === undefined ? to : Math.max(to, handle.least + grid)];
  });
}

// The edits that write them; a number that stays is not touched.
export function edits(changed, begun, grid) {
  const found = new Map();
  changed.forEach(([number, metres], index) => {
    if (number.fixed || Math.abs(metres - begun[index]) < 1e-12) return;
    const [from, to] = number.span;
    found.set(from, { from, to, insert: written(number, metres, grid) });
  });
  return [...found.values()].sort((one, other) => one.from - other.from);
}
