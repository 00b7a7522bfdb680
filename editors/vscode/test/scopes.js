// The grammar as an editor reads it: text in, the scopes of each character out.
"use strict";

const fs = require("node:fs");
const path = require("node:path");
const oniguruma = require("vscode-oniguruma");
const textmate = require("vscode-textmate");

const FOLDER = path.join(__dirname, "..");

async function load() {
  const wasm = fs.readFileSync(require.resolve("vscode-oniguruma/release/onig.wasm"));
  await oniguruma.loadWASM(wasm);
  const file = path.join(FOLDER, "syntaxes", "mission.tmLanguage.json");
  const registry = new textmate.Registry({
    onigLib: Promise.resolve({
      createOnigScanner: (patterns) => new oniguruma.OnigScanner(patterns),
      createOnigString: (text) => new oniguruma.OnigString(text),
    }),
    loadGrammar: async () => textmate.parseRawGrammar(fs.readFileSync(file, "utf8"), file),
  });
  const grammar = await registry.loadGrammar("source.mission");
  if (!grammar) throw new Error(`no grammar in ${file}`);
  return grammar;
}

/** The pieces of a text, in order: where each is, and its scopes, the innermost last. */
function pieces(grammar, text) {
  const found = [];
  let stack = textmate.INITIAL;
  let at = 0;
  for (const line of text.split("\n")) {
    const { tokens, ruleStack } = grammar.tokenizeLine(line, stack);
    for (const token of tokens) {
      // The line's end belongs to its last token.
      const end = Math.min(token.endIndex, line.length);
      found.push({ start: at + token.startIndex, end: at + end, scopes: token.scopes });
    }
    stack = ruleStack;
    at += line.length + 1;
  }
  return found.filter((piece) => piece.end > piece.start);
}

/** What a word of a text is: its innermost scope, without the language's name at its end. */
function scopeOf(grammar, text, word, nth = 0) {
  let at = -1;
  for (let count = 0; count <= nth; count++) {
    at = text.indexOf(word, at + 1);
    if (at < 0) throw new Error(`\`${word}\` is not in the text ${nth + 1} times`);
  }
  const covering = pieces(grammar, text).filter((piece) => piece.start < at + word.length && piece.end > at);
  const scopes = new Set(covering.map((piece) => innermost(piece)));
  return [...scopes].join(" | ");
}

function innermost(piece) {
  return piece.scopes[piece.scopes.length - 1].replace(/\.mission$/, "");
}

module.exports = { FOLDER, load, pieces, innermost, scopeOf };
