// Drags come out in the text as its author would have written them.
import assert from "node:assert/strict";
import test from "node:test";
import { edits, handles, moved, pleasant, whyFixed, written } from "../src/drag_edits.js";

const number = (text, from, unit = 1) => ({
  metres: Number(text) * unit,
  span: [from, from + text.length],
  unit,
  decimals: (text.split(".")[1] ?? "").length,
});
const box = (...texts) => {
  const [a, b, c, d] = texts.map((text, index) => number(text, 10 * index));
  return { form: "box", points: [[a, b], [c, d]], radius: null };
};
const begun = (handle) => handle.follows.map(([each]) => each.metres);

test("a step that people like is 1, 2 or 5 times a power of ten, and no smaller than asked for", () => {
  assert.deepEqual([0.03, 0.2, 0.7, 3, 12, 2000].map(pleasant), [0.05, 0.2, 1, 5, 20, 2000]);
});

test("a number keeps its unit and its decimals, and has more only where the grid needs them", () => {
  assert.equal(written(number("1.80", 0), 2, 0.1), "2.00");
  assert.equal(written(number("3", 0), 2, 0.1), "2");
  assert.equal(written(number("3", 0), 2.4, 0.1), "2.4");
  assert.equal(written(number("1", 0, 1000), 1500, 100), "1.5");
  assert.equal(written(number("200", 0, 0.001), 0.25, 0.01), "250");
  assert.equal(written(number("0.5", 0), -1e-12, 0.1), "0.0");
  assert.equal(written(number("0.5", 0), -0.3, 0.1), "-0.3");
});

test("a whole shape keeps its size, whatever the grid", () => {
  const [whole] = handles(box("0.25", "0.5", "1.75", "2"));
  const found = edits(moved(whole, begun(whole), [0.98, -0.52], 0.1), begun(whole), 0.1);
  assert.deepEqual(found.map(({ insert }) => insert), ["1.25", "0.0", "2.75", "1.5"]);
});

test("a corner takes its own two numbers along and comes to lie on the grid", () => {
  const corner = handles(box("0", "0", "2", "2"))[2];
  const found = edits(moved(corner, begun(corner), [0.97, 0.04], 0.5), begun(corner), 0.5);
  assert.deepEqual(found, [{ from: 20, to: 21, insert: "3" }]);
});

test("a radius stays above zero", () => {
  const disc = { form: "disc", points: [[number("1", 0), number("1", 5)]], radius: number("2", 10) };
  const radius = handles(disc)[1];
  assert.deepEqual(edits(moved(radius, begun(radius), [-9, 3], 0.5), begun(radius), 0.5), [{ from: 10, to: 11, insert: "0.5" }]);
});

test("along an axis with a number that no drag can edit nothing moves, and the other one does", () => {
  const piece = box("0", "0", "2", "2");
  piece.points[1][0] = { metres: 2, fixed: "it is the parameter wide" };
  const [whole] = handles(piece);
  assert.equal(whyFixed(whole), "");
  assert.deepEqual(edits(moved(whole, begun(whole), [1, 1], 1), begun(whole), 1).map(({ from, insert }) => [from, insert]), [[10, "1"], [30, "3"]]);
  piece.points[0][1] = { metres: 0, fixed: "it is the parameter low" };
  assert.equal(whyFixed(handles(piece)[0]), "it is the parameter wide");
});
