// The colours of words while one types. The words are the compiler's own: the server says them.
import { HighlightStyle, StreamLanguage, syntaxHighlighting } from "@codemirror/language";
import { tags } from "@lezer/highlight";

const NUMBER = /^(?:[0-9]+(?:\.(?!\.)[0-9]*)?|\.[0-9]+)(?:[eE][+-]?[0-9]+)?/;
const NAME = /^[\p{L}_][\p{L}\p{N}_]*/u;
const SIGN = /^(?:<->|->|<=|>=|\.\.|[<>=+\-*/!&|])/;

export function missionLanguage(words) {
  const free = new Set(words.free);
  const declaring = new Set(words.declaring);
  const units = [...words.units].sort((one, other) => other.length - one.length);
  const states = new Set(words.states);

  const unitAt = (stream) =>
    units.find((unit) => stream.string.startsWith(unit, stream.pos) && !/[\p{L}\p{N}_]/u.test(stream.string[stream.pos + unit.length] ?? ""));

  function token(stream, state) {
    if (stream.eatSpace()) return null;
    if (stream.peek() === "#") {
      stream.skipToEnd();
      return "comment";
    }
    if (stream.peek() === '"') {
      stream.next();
      while (!stream.eol() && stream.next() !== '"');
      return "string";
    }
    const after = state.after;
    state.after = "";
    if (stream.match(NUMBER)) {
      state.after = "number";
      return "number";
    }
    const unit = after === "number" && unitAt(stream);
    if (unit) {
      stream.pos += unit.length;
      return "unit";
    }
    const name = stream.match(NAME);
    if (name) return nameToken(name[0], after, state);
    if (stream.match(SIGN)) return "operator";
    stream.next();
    return "punctuation";
  }

  // A free word is a name where one is declared, and wherever a name was declared so before.
  function nameToken(word, after, state) {
    if (after === "declares" && (free.has(word) || !words.kinds[word])) {
      if (free.has(word)) state.names = new Set([...state.names, word]);
      return "declared";
    }
    if (declaring.has(word)) state.after = "declares";
    if (words.kinds[word] && !state.names.has(word)) return words.kinds[word];
    return states.has(word) ? "propertyName" : "variableName";
  }

  return StreamLanguage.define({
    name: "mission",
    startState: () => ({ after: "", names: new Set() }),
    copyState: (state) => ({ ...state }),
    token,
    tokenTable: { declared: tags.definition(tags.variableName), unit: tags.unit },
    languageData: { commentTokens: { line: "#" }, closeBrackets: { brackets: ["(", "[", "{", '"'] } },
  });
}

// Classes, so that the style of the page has the colours of day and night.
export const highlighting = syntaxHighlighting(
  HighlightStyle.define([
    { tag: tags.definitionKeyword, class: "tok-declaration" },
    { tag: tags.operatorKeyword, class: "tok-operator" },
    { tag: [tags.modifier, tags.propertyName], class: "tok-part" },
    { tag: tags.typeName, class: "tok-type" },
    { tag: tags.bool, class: "tok-constant" },
    { tag: tags.number, class: "tok-number" },
    { tag: tags.unit, class: "tok-unit" },
    { tag: tags.string, class: "tok-string" },
    { tag: tags.comment, class: "tok-comment" },
    { tag: tags.definition(tags.variableName), class: "tok-declared" },
    { tag: [tags.operator, tags.punctuation], class: "tok-sign" },
  ]),
);
