// A context that writes SVG: as much of CanvasRenderingContext2D as the map is drawn with.
function svgCanvas(width, height, measuring) {
  const parts = [];
  const stack = [];
  let path = "";
  let clips = 0;
  const style = { fillStyle: "#000000", strokeStyle: "#000000", lineWidth: 1, globalAlpha: 1, font: "10px sans-serif", textAlign: "left", textBaseline: "alphabetic", lineJoin: "miter", lineCap: "butt", dash: [], group: 0 };
  const own = { ...style };

  const number = (value) => String(Math.round(value * 100) / 100);
  const text = (value) => String(value).replace(/[<>&"]/g, (letter) => `&#${letter.charCodeAt(0)};`);
  const faded = (alpha) => (alpha < 1 ? ` opacity="${number(alpha)}"` : "");
  const drawnLike = () => `stroke="${own.strokeStyle}" stroke-width="${number(own.lineWidth)}" stroke-linejoin="${own.lineJoin}" stroke-linecap="${own.lineCap}"${own.dash.length ? ` stroke-dasharray="${own.dash.map(number).join(" ")}"` : ""}`;
  const add = (markup) => parts.push(markup);

  function words(said, x, y, paint) {
    const size = /(\d+(?:\.\d+)?)px/.exec(own.font);
    const weight = /^\s*(bold|\d{3})\b/.exec(own.font);
    const anchor = { center: "middle", right: "end" }[own.textAlign] || "start";
    const down = { middle: 0.35, top: 0.8 }[own.textBaseline] || 0;
    const tall = size ? Number(size[1]) : 10;
    add(`<text x="${number(x)}" y="${number(y + down * tall)}" font-size="${tall}" font-family="system-ui, sans-serif"${weight ? ` font-weight="${weight[1]}"` : ""} text-anchor="${anchor}" ${paint}${faded(own.globalAlpha)}>${text(said)}</text>`);
  }

  const context = {
    beginPath: () => (path = ""),
    moveTo: (x, y) => (path += `M${number(x)} ${number(y)}`),
    lineTo: (x, y) => (path += `${path ? "L" : "M"}${number(x)} ${number(y)}`),
    closePath: () => (path += "Z"),
    arc: (x, y, radius) => context.ellipse(x, y, radius, radius),
    // Whole ones are all that is drawn.
    ellipse(x, y, across, up) {
      const [a, b] = [number(across), number(up)];
      path += `M${number(x - across)} ${number(y)}A${a} ${b} 0 1 0 ${number(x + across)} ${number(y)}A${a} ${b} 0 1 0 ${number(x - across)} ${number(y)}Z`;
    },
    fill(rule) {
      if (path) add(`<path d="${path}" fill="${own.fillStyle}"${rule ? ` fill-rule="${rule}"` : ""}${faded(own.globalAlpha)}/>`);
    },
    stroke() {
      if (path) add(`<path d="${path}" fill="none" ${drawnLike()}${faded(own.globalAlpha)}/>`);
    },
    fillRect: (x, y, wide, tall) => add(`<rect x="${number(x)}" y="${number(y)}" width="${number(wide)}" height="${number(tall)}" fill="${own.fillStyle}"${faded(own.globalAlpha)}/>`),
    fillText: (said, x, y) => words(said, x, y, `fill="${own.fillStyle}"`),
    strokeText: (said, x, y) => words(said, x, y, `fill="none" ${drawnLike()}`),
    measureText(said) {
      measuring.font = own.font;
      return measuring.measureText(said);
    },
    // A group that lasts until what was saved is restored; the address is of this picture itself.
    clip(rule) {
      clips++;
      own.group++;
      add(`<clipPath id="clip${clips}"><path d="${path}"${rule ? ` clip-rule="${rule}"` : ""}/></clipPath><g clip-path="${"url"}(#clip${clips})">`);
    },
    translate(right, down) {
      own.group++;
      add(`<g transform="translate(${number(right)} ${number(down)})">`);
    },
    save() {
      stack.push({ ...own });
      own.group = 0;
    },
    restore() {
      for (; own.group > 0; own.group--) add("</g>");
      Object.assign(own, stack.pop());
    },
    setLineDash: (dash) => (own.dash = dash),
    setTransform() {},
    // The whole picture. The namespace is the one that this page's own pictures have.
    written(title) {
      const picture = document.createElementNS(document.querySelector("svg").namespaceURI, "svg");
      for (const [name, value] of Object.entries({ width, height, viewBox: `0 0 ${width} ${height}` })) picture.setAttribute(name, value);
      picture.innerHTML = `<title>${text(title)}</title>${parts.join("")}`;
      return new XMLSerializer().serializeToString(picture);
    },
  };
  for (const name of Object.keys(style)) {
    if (name === "dash" || name === "group") continue;
    Object.defineProperty(context, name, { get: () => own[name], set: (value) => (own[name] = value) });
  }
  return context;
}
