// What is drawn on a canvas, or on anything that has its methods.
function line(context, x0, y0, x1, y1) {
  context.beginPath();
  context.moveTo(x0, y0);
  context.lineTo(x1, y1);
  context.stroke();
}

function circle(context, x, y, radius) {
  context.beginPath();
  context.arc(x, y, radius, 0, 2 * Math.PI);
}

// How far a shape reaches along an axis of the floor, metres.
function extent(shape, axis) {
  const ends = shape.parts.flatMap((part) => {
    const round = part.disc || part.ball;
    return round ? [round[axis] - round.at(-1), round[axis] + round.at(-1)] : part.rings.flatMap((ring) => ring.map((corner) => corner[axis]));
  });
  return [Math.min(...ends), Math.max(...ends)];
}

// Whether a shape has a place of the floor in it or below it.
const covers = (shape, x, y) =>
  shape.parts.some((part) => {
    const round = part.disc || part.ball;
    if (round) return Math.hypot(x - round[0], y - round[1]) <= round.at(-1);
    let odd = false;
    for (const ring of part.rings) {
      ring.forEach(([ax, ay], corner) => {
        const [bx, by] = ring[(corner + 1) % ring.length];
        if (ay > y !== by > y && x < ((bx - ax) * (y - ay)) / (by - ay) + ax) odd = !odd;
      });
    }
    return odd;
  });

function polygon(context, points) {
  context.beginPath();
  points.forEach(([x, y], corner) => context[corner ? "lineTo" : "moveTo"](x, y));
  context.closePath();
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

// Corners of the marks by which agents are told apart, around 0 at size 1; a disc has none.
const CORNERS = {
  disc: null,
  square: [[-0.85, -0.85], [0.85, -0.85], [0.85, 0.85], [-0.85, 0.85]],
  triangle: [[0, -1.15], [1.05, 0.75], [-1.05, 0.75]],
  diamond: [[0, -1.2], [1.2, 0], [0, 1.2], [-1.2, 0]],
  plus: [[-0.4, -1.1], [0.4, -1.1], [0.4, -0.4], [1.1, -0.4], [1.1, 0.4], [0.4, 0.4], [0.4, 1.1], [-0.4, 1.1], [-0.4, 0.4], [-1.1, 0.4], [-1.1, -0.4], [-0.4, -0.4]],
  cross: [[-1.1, -0.6], [-0.6, -1.1], [0, -0.5], [0.6, -1.1], [1.1, -0.6], [0.5, 0], [1.1, 0.6], [0.6, 1.1], [0, 0.5], [-0.6, 1.1], [-1.1, 0.6], [-0.5, 0]],
  hexagon: [[-1.1, 0], [-0.55, -0.95], [0.55, -0.95], [1.1, 0], [0.55, 0.95], [-0.55, 0.95]],
  wedge: [[0, 1.15], [-1.05, -0.75], [1.05, -0.75]],
};

function mark(context, name, x, y, size) {
  const corners = CORNERS[name];
  if (corners) polygon(context, corners.map(([right, down]) => [x + right * size, y + down * size]));
  else circle(context, x, y, size);
}

// The same on a page, for the buttons of agents.
function markIcon(name, colour) {
  const icon = document.createElementNS(document.querySelector("svg").namespaceURI, "svg");
  icon.setAttribute("viewBox", "-1.4 -1.4 2.8 2.8");
  icon.setAttribute("aria-hidden", "true");
  icon.classList.add("mark");
  const shape = document.createElementNS(icon.namespaceURI, CORNERS[name] ? "polygon" : "circle");
  if (CORNERS[name]) shape.setAttribute("points", CORNERS[name].map((corner) => corner.join(",")).join(" "));
  else shape.setAttribute("r", "1");
  shape.setAttribute("fill", colour);
  icon.append(shape);
  return icon;
}

function star(context, x, y, size, palette) {
  polygon(
    context,
    Array.from({ length: 10 }, (_, corner) => {
      const far = corner % 2 ? size * 0.45 : size;
      return [x + far * Math.sin((corner * Math.PI) / 5), y - far * Math.cos((corner * Math.PI) / 5)];
    }),
  );
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
  polygon(context, [[x + 6 * along, y + 6 * across], [x - 6 * along - 5 * across, y - 6 * across + 5 * along], [x - 6 * along + 5 * across, y - 6 * across - 5 * along]]);
  context.fillStyle = colour;
  context.fill();
}

// A step between lines of a grid or axis that people like: 1, 2 or 5 times a power of ten.
function pleasant(range, lines) {
  const rough = range / lines;
  const power = 10 ** Math.floor(Math.log10(rough));
  return [1, 2, 5, 10].map((times) => times * power).find((step) => step >= rough * 0.999);
}

// Three digits, never more than a millimetre.
function short(value) {
  if (value === 0) return "0";
  if (value === Infinity) return "∞";
  if (value === -Infinity) return "−∞";
  const digits = Math.abs(value) >= 100 ? 0 : Math.abs(value) >= 10 ? 1 : Math.abs(value) >= 1 ? 2 : 3;
  return value.toFixed(digits).replace("-", "−");
}

const tidy = (value) => String(Number(value.toFixed(6))).replace("-", "−");
