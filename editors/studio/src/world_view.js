// The map: what the scene holds, drawn; dragged by pointer or arrow keys; in step with the cursor in the text.
import { edits, handles, moved, whyFixed } from "./drag_edits.js";
import { element, gridLines, nameWidth, partsPath, partsWidth, piecePath, titled } from "./draw.js";
import { Frame } from "./frame.js";
import { carry, key, withGhosts } from "./scene.js";

const CROWD = 16; // obstacles of which all are named; of more, those that are wide enough
const CLICK = 3; // pixels that a pointer may move and still click
const ORDER = ["world", "region", "obstacle", "finish", "start", "beacon"];
const HUES = [205, 24, 145, 308, 48, 246, 82, 176]; // of regions, in the order of the report's
const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowDown: [0, -1], ArrowUp: [0, 1] };

export class WorldView {
  // `text`: begin(), preview(edits), end(cancelled), which change the text as a drag goes on; select(span) and focus().
  constructor(svg, text) {
    this.svg = svg;
    this.text = text;
    this.frame = new Frame();
    this.scene = null;
    this.drag = null;
    this.cursor = -1;
    this.colours = new Map();
    new ResizeObserver(() => this.draw()).observe(svg);
    svg.addEventListener("pointerdown", (event) => this.down(event));
    svg.addEventListener("pointermove", (event) => this.move(event));
    svg.addEventListener("pointerup", (event) => this.up(event, false));
    svg.addEventListener("pointercancel", (event) => this.up(event, true));
    svg.addEventListener("keydown", (event) => this.key(event));
    svg.addEventListener("wheel", (event) => this.wheel(event), { passive: false });
  }

  // What the server drew; a drag that is under way keeps its own numbers.
  show(scene, whole) {
    this.scene = scene && withGhosts(scene, this.scene, whole);
    if (this.drag?.handle) this.follow();
    this.draw();
  }

  // Nothing is left of the mission before.
  clear() {
    this.scene = null;
    this.drag = null;
    this.colours.clear();
    this.fit();
  }

  carry(changes, dragged) {
    carry(this.scene, changes, dragged);
  }

  // Light what is declared where the cursor is.
  light(cursor) {
    this.cursor = cursor;
    this.draw();
  }

  fit() {
    this.frame.fitted = true;
    this.draw();
  }

  zoom(times) {
    const { width, height } = this.svg.getBoundingClientRect();
    this.frame.zoom(times, width / 2, height / 2);
    this.draw();
  }

  draw() {
    const { width, height } = this.svg.getBoundingClientRect();
    if (!width || !height) return;
    const focused = document.activeElement?.dataset?.at;
    this.svg.replaceChildren();
    this.svg.classList.toggle("dragging", Boolean(this.drag?.handle));
    if (!this.scene) return;
    if (this.frame.fitted && !this.drag) this.frame.fit(this.scene, width, height);
    const things = [...this.scene.things].sort((one, other) => ORDER.indexOf(one.kind) - ORDER.indexOf(other.kind));
    const [world, ...others] = things[0]?.kind === "world" ? things : [null, ...things];
    if (world) this.svg.append(this.thing(world));
    this.svg.append(gridLines(this.frame, this.scene), ...others.map((thing) => this.thing(thing)), ...[...things].reverse().map((thing) => this.label(thing)));
    if (focused) this.svg.querySelector(`[data-at="${CSS.escape(focused)}"][tabindex]`)?.focus();
  }

  lit = ({ span }) => span && span[0] <= this.cursor && this.cursor <= span[1];

  thing(thing) {
    const { frame } = this;
    const group = element("g", { class: `thing ${thing.kind}${thing.ghost ? " ghost" : ""}${this.lit(thing) ? " lit" : ""}`, "data-thing": key(thing) });
    if (thing.kind === "region") group.style.setProperty("--hue", this.hue(thing.name));
    const alone = thing.pieces.length === 1 && (thing.kind === "world" || (thing.parts?.length ?? 2) <= 1);
    if (thing.parts && !alone) group.append(element("path", { class: "fill", d: partsPath(frame, thing.parts), "fill-rule": "evenodd" }));
    const together = thing.pieces.length === 1 && thing.pieces[0].form !== "point" ? { "data-at": `${key(thing)}/0`, "data-handle": "0" } : {};
    for (const [x, y] of thing.agents ?? []) {
      const body = { cx: frame.x(x), cy: frame.y(y), r: Math.max(3, thing.radius * frame.scale) };
      group.append(titled(element("circle", { class: "agent", ...body, ...together }), `${thing.kind} ${thing.name}`));
    }
    if (thing.way?.length) group.append(this.way(thing));
    thing.pieces.forEach((piece, index) => group.append(...this.piece(thing, piece, index, alone)));
    return group;
  }

  hue(name) {
    if (!this.colours.has(name)) this.colours.set(name, `${HUES[this.colours.size % HUES.length]}`);
    return this.colours.get(name);
  }

  // The way of a moving obstacle, from the middle of its shape.
  way(thing) {
    const [x, y] = this.middle(thing);
    const points = thing.way.map(([across, up]) => `${this.frame.x(x + across)},${this.frame.y(y + up)}`);
    return titled(element("polyline", { class: "way", points: points.join(" ") }), `path of ${thing.name}`);
  }

  middle(thing) {
    const piece = thing.pieces[0];
    if (piece && !(piece.form === "polygon" && thing.inner)) return handles(piece)[0].at;
    return thing.inner ?? thing.agents?.[0] ?? this.scene.low;
  }

  piece(thing, piece, index, alone) {
    const { frame } = this;
    const [whole, ...others] = handles(piece);
    const why = this.whyNot(thing, piece, whole);
    const words = `${thing.kind} ${thing.name}${why ? `: not draggable, ${why}` : ""}`;
    const at = `${key(thing)}/${index}`;
    const common = { "data-at": at, "data-handle": "0", class: `piece ${piece.form}${alone ? " alone" : ""}${why ? " fixed" : ""}` };
    const reachable = { tabindex: why ? undefined : "0", role: "button", "aria-label": `${words}${why ? "" : "; move with the arrow keys"}` };
    const body =
      piece.form === "point"
        ? this.point(thing, frame.x(whole.at[0]), frame.y(whole.at[1]), { ...common, ...reachable })
        : element("path", { d: piecePath(frame, piece), ...common, ...(thing.kind === "world" ? {} : reachable) });
    const shown = thing.ghost ? [] : others.filter((handle) => !this.whyNot(thing, piece, handle));
    return [titled(body, words), ...shown.map((handle) => this.handle(at, others.indexOf(handle) + 1, handle, thing))];
  }

  point(thing, x, y, attributes) {
    if (thing.kind === "beacon") return element("path", { d: `M${x},${y - 9}L${x + 8},${y + 6}H${x - 8}Z`, ...attributes });
    return element("circle", { cx: x, cy: y, r: Math.max(5, (thing.radius ?? 0) * this.frame.scale), ...attributes });
  }

  handle(at, number, handle, thing) {
    const [x, y] = [this.frame.x(handle.at[0]), this.frame.y(handle.at[1])];
    const made = element("rect", { x: x - 5, y: y - 5, width: 10, height: 10, rx: 2, class: "handle", "data-at": at, "data-handle": number });
    return titled(made, `${handle.name} of ${thing.name}`);
  }

  label(thing) {
    if (thing.kind === "world" || this.nameless(thing)) return "";
    if (thing.region) return this.guests(thing);
    const [x, y] = thing.agents?.[0] ?? this.middle(thing);
    const down = thing.kind === "region" || thing.kind === "obstacle" ? 4 : -12;
    const words = thing.kind === "finish" ? `${thing.name} finish` : thing.name;
    return element("text", { class: `name ${thing.kind}`, x: this.frame.x(x), y: this.frame.y(y) + down, "text-anchor": "middle" }, words);
  }

  // One of many obstacles, too narrow for its name: pointed at, it says it.
  nameless(thing) {
    if (thing.kind !== "obstacle" || this.lit(thing)) return false;
    if (this.scene.things.filter((each) => each.kind === "obstacle").length <= CROWD) return false;
    return partsWidth(thing.parts ?? []) * this.frame.scale < nameWidth(thing.name);
  }

  // Who is somewhere in a region, written below its name.
  guests({ kind, name, region, count, span }) {
    const home = this.scene.things.find((thing) => thing.kind === "region" && thing.name === region);
    if (!home) return "";
    const [x, y] = this.middle(home);
    const words = `${name}${count > 1 ? ` × ${count}` : ""} ${kind === "start" ? "start" : "finish"} here`;
    return element("text", { class: `guests${this.lit({ span }) ? " lit" : ""}`, x: this.frame.x(x), y: this.frame.y(y) + (kind === "start" ? 19 : 33), "text-anchor": "middle" }, words);
  }

  // Why a handle cannot be dragged; empty where it can.
  whyNot(thing, piece, handle) {
    if (thing.ghost) return "its declaration has an error";
    return piece.span ? whyFixed(handle) : "it is in an included file";
  }

  found(target) {
    const { at, handle } = target.dataset ?? {};
    if (at === undefined) return null;
    const [name, index] = [at.slice(0, at.lastIndexOf("/")), Number(at.slice(at.lastIndexOf("/") + 1))];
    const thing = this.scene?.things.find((each) => key(each) === name && each.pieces[index]);
    if (!thing) return null;
    const piece = thing.pieces[index];
    return { at, number: Number(handle), thing, piece, handle: handles(piece)[Number(handle)] };
  }

  down(event) {
    if (event.button !== 0 || this.drag) return;
    const found = this.found(event.target);
    const free = found && !this.whyNot(found.thing, found.piece, found.handle) && !(found.thing.kind === "world" && found.number === 0);
    this.drag = { x: event.clientX, y: event.clientY, began: [event.clientX, event.clientY], hit: found, passed: false };
    if (free) Object.assign(this.drag, this.begun(found));
    this.svg.setPointerCapture(event.pointerId);
  }

  begun = ({ at, number, handle }) => ({ handle, at, number, begun: handle.follows.map(([each]) => each.metres) });

  move(event) {
    const { drag } = this;
    if (!drag) return;
    const [across, down] = [event.clientX - drag.began[0], event.clientY - drag.began[1]];
    if (!drag.passed && Math.hypot(across, down) < CLICK) return;
    if (drag.handle) {
      if (!drag.passed) this.text.begin();
      drag.passed = true;
      this.to([this.frame.metres(across), -this.frame.metres(down)], this.frame.grid(event.shiftKey));
    } else {
      drag.passed = true;
      this.frame.pan(event.clientX - drag.x, event.clientY - drag.y);
      [drag.x, drag.y] = [event.clientX, event.clientY];
      this.draw();
    }
  }

  // Drag to so many metres from where it began: the numbers change on the map and in the text.
  to(shift, grid) {
    const { drag } = this;
    const changed = moved(drag.handle, drag.begun, shift, grid);
    const before = changed.map(([number]) => number.metres);
    for (const [number, metres] of changed) number.metres = metres;
    drag.metres = changed.map(([, metres]) => metres);
    const found = edits(changed, before, grid);
    if (found.length) this.text.preview(found);
    this.draw();
  }

  // A new scene came amid a drag: what is dragged is found in it again, with the numbers that the drag has given it.
  follow() {
    const { drag } = this;
    const again = this.found({ dataset: { at: drag.at, handle: drag.number } });
    if (!again || again.handle.follows.length !== drag.begun.length) return;
    drag.handle = again.handle;
    again.handle.follows.forEach(([number], index) => (number.metres = drag.metres?.[index] ?? number.metres));
  }

  up(event, cancelled) {
    const { drag } = this;
    if (!drag) return;
    this.drag = null;
    if (drag.handle && drag.passed) this.text.end(cancelled);
    else if (!drag.passed && drag.hit?.thing.span) this.text.select(drag.hit.piece.span && drag.hit.number ? drag.hit.piece.span : drag.hit.thing.span);
    if (event.type === "pointerup" && drag.at) this.svg.querySelector(`[data-at="${CSS.escape(drag.at)}"][tabindex]`)?.focus({ preventScroll: true });
    this.draw();
  }

  key(event) {
    const found = this.found(event.target);
    if (event.key === "Escape" && this.drag?.handle) return this.up(event, true);
    if (found && event.key === "Enter") {
      event.preventDefault();
      this.text.select(found.thing.span);
      return this.text.focus();
    }
    const arrow = ARROWS[event.key];
    if (!found || !arrow || this.whyNot(found.thing, found.piece, found.handle)) return;
    event.preventDefault();
    const grid = this.frame.grid(event.shiftKey);
    this.drag = this.begun(found);
    this.text.begin();
    this.to(arrow.map((steps) => steps * grid), grid);
    this.drag = null;
    this.text.end(false);
    this.draw();
  }

  wheel(event) {
    if (!this.scene) return;
    event.preventDefault();
    const { left, top } = this.svg.getBoundingClientRect();
    this.frame.zoom(Math.exp(-event.deltaY * 0.0015), event.clientX - left, event.clientY - top);
    this.draw();
  }
}
