// What a person would look at: the places where a highlighter that only knows words goes wrong.
"use strict";

const assert = require("node:assert/strict");
const { before, describe, it } = require("node:test");
const { load, pieces, innermost, scopeOf } = require("./scopes");

describe("the grammar", () => {
  let grammar;
  before(async () => {
    grammar = await load();
  });

  /** Each word of a text that is asked about, with what it is taken for. */
  function reads(text, expected) {
    for (const [word, scope] of expected) assert.equal(scopeOf(grammar, text, word), scope, `\`${word}\` in \`${text}\``);
  }

  it("gives a name at its declaration a scope of its own, and elsewhere none of a declaration", () => {
    const text = "region pad = box (1, 1) to (2, 2)\nrequire home: every drone: always[0, end] pad";
    assert.equal(scopeOf(grammar, text, "pad"), "entity.name.type.region");
    assert.equal(scopeOf(grammar, text, "pad", 1), "variable.other");
    assert.equal(scopeOf(grammar, text, "home"), "entity.name.function.requirement");
    assert.equal(scopeOf(grammar, text, "drone"), "variable.other");
  });

  it("takes a name that begins, or ends, like a keyword for a name", () => {
    reads("require _end: every drone: always_home and at_base or nottrue", [
      ["always_home", "variable.other"],
      ["at_base", "variable.other"],
      ["nottrue", "variable.other"],
      ["_end", "entity.name.function.requirement"],
    ]);
  });

  it("takes an operator's letter for the operator, and a team of that letter for a team", () => {
    const text = "let both = F[0, 5 s] U[0] U[0, 5 s] U[0..2] R[hops 1..2] R[1]";
    assert.equal(scopeOf(grammar, text, "F"), "keyword.control.temporal");
    assert.equal(scopeOf(grammar, text, "U"), "variable.other");
    assert.equal(scopeOf(grammar, text, "U", 1), "keyword.control.temporal");
    assert.equal(scopeOf(grammar, text, "U", 2), "variable.other");
    assert.equal(scopeOf(grammar, text, "R"), "keyword.control.spatial");
    assert.equal(scopeOf(grammar, text, "R", 1), "variable.other");
    reads("region Fire = box", [["Fire", "entity.name.type.region"]]);
  });

  it("sees nothing in a comment, and nothing of a comment in a string", () => {
    const comment = "# require always[0, 5 s] (base";
    assert.deepEqual(pieces(grammar, comment).map(innermost), ["comment.line.number-sign"]);
    reads('include "a#always.mission" # 5 m', [
      ['"a#always.mission"', "string.quoted.double"],
      ["# 5 m", "comment.line.number-sign"],
    ]);
  });

  it("tells a number from its unit, with a blank between or without", () => {
    for (const text of ["separation 0.5m", "separation 0.5 m", "separation .5   m"]) {
      assert.match(scopeOf(grammar, text, "5"), /^constant\.numeric$/);
      assert.equal(scopeOf(grammar, text, "m"), "keyword.other.unit");
    }
    reads("agent a { dynamics double_integrator(acceleration <= 1.5e-1m/s^2) }", [
      ["1.5e-1", "constant.numeric"],
      ["m/s^2", "keyword.other.unit"],
    ]);
  });

  it("takes a unit's letters for a name where no number stands before them", () => {
    const text = "require s: at least 2 m: eventually[0, 5 m] m";
    assert.equal(scopeOf(grammar, text, "s"), "entity.name.function.requirement");
    const found = pieces(grammar, text).filter((piece) => text.slice(piece.start, piece.end) === "m");
    assert.deepEqual(found.map(innermost), ["variable.other", "keyword.other.unit", "variable.other"]);
  });

  it("marks windows, in time and along routes", () => {
    const text = "require r: every drone: always[0, 5 s] base reach[hops 0..2 on radio] base";
    const within = (word) => pieces(grammar, text).find((piece) => piece.start === text.indexOf(word)).scopes;
    assert.ok(within("5").includes("meta.window.temporal.mission"));
    assert.ok(within("hops").includes("meta.window.spatial.mission"));
    assert.ok(!within("base").some((scope) => scope.startsWith("meta.window")));
  });

  it("takes a word that is not reserved for a keyword only where its declaration asks for it", () => {
    reads("region path = box (0, 0) to (1, 1)", [["path", "entity.name.type.region"]]);
    reads("team d[2] { yaw along path start in path }", [["path", "keyword.other.part"]]);
    assert.equal(scopeOf(grammar, "team d[2] { yaw along path start in path }", "path", 1), "variable.other");
    reads("formation f = chain of total spacing 1 m total tolerance 1 m", [["total", "variable.other"]]);
  });

  it("finds the next declaration while the one before it is half written", () => {
    for (const half of ["team drone[3] { radius", "require home: every drone: always[0,", "region", "let a = (b and", "param T ="]) {
      const text = `${half}\nregion base = box (0, 0) to (1, 1)`;
      assert.equal(scopeOf(grammar, text, "base"), "entity.name.type.region", half);
    }
  });
});
