// Every token of every mission has the scope that the compiler's own reading of it calls for.
"use strict";

const assert = require("node:assert/strict");
const { execFileSync } = require("node:child_process");
const path = require("node:path");
const { before, describe, it } = require("node:test");
const { FOLDER, load, pieces, innermost } = require("./scopes");

/** The repository, where the extension is tested from a copy. */
const ROOT = process.env.MISSIONC_ROOT ?? path.join(FOLDER, "..", "..");
const PYTHON = process.env.PYTHON ?? "python3";

const SCOPES = {
  keyword: /^(keyword\.(declaration|control|other\.(?!unit)|operator\.wordlike)|constant\.language|support\.type\.shape)/,
  operator: /^keyword\.operator\.(logical|comparison|range|arithmetic|assignment)$/,
  number: /^constant\.numeric$/,
  unit: /^keyword\.other\.unit$/,
  string: /^string\./,
  comment: /^comment\.line/,
  label: /^entity\.name\.function\.(requirement|preference)$/,
  punctuation: /^punctuation\./,
  name: /^(entity\.name|variable|support\.(type\.(?!shape)|function|constant))/,
};

const missions = JSON.parse(
  execFileSync(PYTHON, ["-m", "tests.support.lexed_missions"], { cwd: ROOT, encoding: "utf8", maxBuffer: 1 << 28 }),
);

describe("every mission", () => {
  let grammar;
  before(async () => {
    grammar = await load();
  });

  it("is among those looked at", () => {
    const names = missions.map((mission) => mission.name);
    assert.ok(names.includes(path.join("missions", "wildfire.mission")));
    assert.ok(names.some((name) => name.startsWith("docs/language.md")));
    assert.ok(names.includes(path.join("editors", "vscode", "test", "tricky.mission")));
  });

  function wrong({ text, tokens }) {
    const found = pieces(grammar, text);
    return tokens.filter((token) => {
      const covering = found.filter((piece) => piece.start < token.end && piece.end > token.start);
      const whole = covering.length === 1 && covering[0].start === token.start && covering[0].end === token.end;
      token.found = covering.map(innermost).join(" | ");
      return !whole || !SCOPES[token.class].test(token.found);
    });
  }

  const drawn = (mission) => mission.name.startsWith("drawn");

  for (const mission of missions.filter((mission) => !drawn(mission))) {
    it(`${mission.name} is highlighted as the compiler reads it`, () => {
      assert.deepEqual(wrong(mission).map((token) => where(mission.text, token)), []);
    });
  }

  it("may be drawn at random, and use as a name whatever may be one", () => {
    const random = missions.filter(drawn);
    assert.ok(random.length >= 100);
    for (const mission of random) {
      // Only what stands before it tells `prefer weight weight 2` apart, and the member `U[2]` of a family from an
      // operator with its window; a grammar of patterns looks ahead.
      const alike = (token) => token.text === "weight" || /^\w+\[/.test(mission.text.slice(token.start));
      const left = wrong(mission).filter((token) => !alike(token));
      assert.deepEqual(left.map((token) => where(mission.text, token)), [], mission.text);
    }
  });

  it("uses, taken together, every keyword of the language", () => {
    const seen = new Set(missions.flatMap(({ tokens }) => tokens.filter((t) => t.class === "keyword").map((t) => t.text)));
    const words = JSON.parse(
      execFileSync(
        PYTHON,
        ["-c", "import json; from missionc.frontend.syntax.tokens import SPELLINGS; print(json.dumps([*SPELLINGS]))"],
        { cwd: ROOT, encoding: "utf8" },
      ),
    );
    const missing = words.filter((word) => /^\w/.test(word) && !seen.has(word));
    assert.deepEqual(missing, []);
  });
});

function where(text, token) {
  const line = text.slice(0, token.start).split("\n").length;
  return `\`${token.text}\`, a ${token.class} on line ${line}, is ${token.found}`;
}
