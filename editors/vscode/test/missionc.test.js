// What the extension calls, worked out from its setting and the text.
"use strict";

const assert = require("node:assert/strict");
const path = require("node:path");
const { describe, it } = require("node:test");
const { compileArguments, missionName, programPath, serverArguments, whyNot } = require("../src/missionc");

const WORK = path.resolve("/work place");
const HOME = path.resolve("/home/$1");

describe("the program", () => {
  it("is looked up by its name where the setting is one, or is empty", () => {
    assert.equal(programPath("missionc", WORK, HOME), "missionc");
    assert.equal(programPath("  ", WORK, HOME), "missionc");
  });

  it("may lie in the folder that is open, said either way", () => {
    const inside = path.join(WORK, ".venv", "bin", "missionc");
    assert.equal(programPath("${workspaceFolder}/.venv/bin/missionc", WORK, HOME), inside);
    assert.equal(programPath("./.venv/bin/missionc", WORK, HOME), inside);
  });

  it("may lie in the home folder, whatever that is called", () => {
    assert.equal(programPath("~/bin/missionc", undefined, HOME), `${HOME}/bin/missionc`);
  });

  it("stays where an absolute path says", () => {
    const there = path.resolve("/opt/missionc");
    assert.equal(programPath(there, WORK, HOME), there);
  });

  it("is called with a word for each thing, and no shell between", () => {
    assert.deepEqual(serverArguments(), ["lsp"]);
    assert.deepEqual(compileArguments("/a b/$(c).mission"), ["compile", "/a b/$(c).mission", "--force"]);
  });

  it("is named in the message that says why it did not start, with the way out", () => {
    assert.match(whyNot("/opt/missionc"), /`\/opt\/missionc lsp` did not start.*pip install 'missionc\[lsp\]'/);
  });
});

describe("the mission's name", () => {
  it("is found wherever it is declared", () => {
    assert.equal(missionName("# mission no\ninclude \"mission not\"\nworld (0, 0) to (1, 1) mission relay_2"), "relay_2");
  });

  it("is not made of part of a word, and is empty where there is none", () => {
    assert.equal(missionName("region submission x = box"), "");
    assert.equal(missionName("# mission no"), "");
  });
});
