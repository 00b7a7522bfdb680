"""The LALR parse table of the grammar: the action of each state on each token.

Building the table with Lark takes half the time allowed for a complete ``check``, so it is built in advance and stored
as JSON next to the grammar:

    python -m missionc.frontend.syntax.parse_table
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from functools import cache
from typing import TYPE_CHECKING

from missionc.base.late_dataclass import Record
from missionc.base.resources import folder

if TYPE_CHECKING:
    from lark.grammar import Rule as LarkRule
    from lark.grammar import Symbol
    from lark.lexer import LexerState, Token

END = "END"
"""Kind of the token that marks the end of the text."""


class Rule(Record):
    """Grammar rule as the parser applies it in a reduction.

    ``name`` is the function that builds the node; empty if the single part is passed on unchanged, ``*`` if the parts
    become parts of the enclosing rule. ``keep`` selects the parts by index; -1 is an absent optional part.
    """

    symbol: str
    name: str
    size: int
    keep: tuple[int, ...]


class Table(Record):
    """LALR parse table; ``actions[state][token]`` is the next state, or ``-1 - n`` for a reduction by ``rules[n]``.

    Tokens are words and signs as written, or the grammar's upper-case names. State 0 is the start; in the state
    ``accept`` the text may end.
    """

    accept: int
    actions: tuple[dict[str, int], ...]
    gotos: tuple[dict[str, int], ...]
    rules: tuple[Rule, ...]


@cache
def load() -> Table:
    """Parse table stored next to the grammar."""
    data = json.loads((folder("grammars") / "mission.json").read_text(encoding="utf-8"))
    return Table(
        accept=data["accept"],
        actions=tuple(data["actions"]),
        gotos=tuple(data["gotos"]),
        rules=tuple(Rule(symbol, name, size, tuple(keep)) for symbol, name, size, keep in data["rules"]),
    )


def build(grammar: str) -> Table:
    """Parse table of a grammar, built with Lark."""
    from lark import Lark
    from lark.lexer import Lexer
    from lark.parsers.lalr_analysis import Shift

    class NoLexer(Lexer):
        """Placeholder with which Lark builds no lexer of its own, since ``tokens.py`` has it."""

        def __init__(self, _: object) -> None:
            pass

        def lex(self, lexer_state: LexerState, parser_state: object) -> Iterator[Token]:
            raise NotImplementedError

    lark = Lark(grammar, parser="lalr", lexer=NoLexer, maybe_placeholders=True)
    texts = {terminal.name: terminal.pattern.value for terminal in lark.terminals if terminal.pattern is not None}
    texts["$END"] = END
    lalr = lark.parser.parser._parse_table
    # Lark numbers states and rules differently each time; ours are in the order of a walk from the start.
    states = {lalr.start_states["start"]: 0}
    rules: dict[LarkRule, int] = {}
    actions: list[dict[str, int]] = []
    gotos: list[dict[str, int]] = []
    queue = list(states)
    for state in queue:
        actions.append({})
        gotos.append({})
        for symbol, (action, argument) in sorted(lalr.states[state].items()):
            if action is not Shift:
                actions[-1][texts.get(symbol, symbol)] = -1 - rules.setdefault(argument, len(rules))
                continue
            if argument not in states:
                queue.append(argument)
            target = states.setdefault(argument, len(states))
            (actions if symbol.isupper() else gotos)[-1][texts.get(symbol, symbol)] = target
    return Table(
        accept=states[lalr.end_states["start"]],
        actions=tuple(actions),
        gotos=tuple(gotos),
        rules=tuple(_rule(rule) for rule in rules),
    )


def write(table: Table) -> str:
    """Text of the parse table as JSON, one state or rule on each line."""
    rules = [[rule.symbol, rule.name, rule.size, rule.keep] for rule in table.rules]
    lists = {"rules": rules, "actions": table.actions, "gotos": table.gotos}
    parts = [f'"accept": {table.accept}']
    for name, rows in lists.items():
        parts.append(f'"{name}": [\n' + ",\n".join(json.dumps(row) for row in rows) + "\n]")
    return "{\n" + ",\n".join(parts) + "\n}\n"


def _rule(rule: LarkRule) -> Rule:
    symbol = str(rule.origin.name)
    if symbol.startswith("__"):
        name = "*"
    elif rule.alias is None and rule.options.expand1:
        name = ""
    else:
        name = str(rule.alias or symbol)
    return Rule(symbol, name, len(rule.expansion), tuple(_kept(rule)))


def _kept(rule: LarkRule) -> list[int]:
    """Indices of a rule's parts that the tree keeps, by Lark's convention.

    Quoted words and signs are omitted, and an absent ``[optional]`` leaves a gap.
    """
    symbols: list[Symbol] = list(rule.expansion)
    gaps = rule.options.empty_indices or (False,) * len(symbols)
    positions = []
    place = 0
    for gap in gaps:
        if gap:
            positions.append(-1)
        else:
            symbol = symbols[place]
            if rule.options.keep_all_tokens or not (symbol.is_term and getattr(symbol, "filter_out", False)):
                positions.append(place)
            place += 1
    return positions


if __name__ == "__main__":
    grammars = folder("grammars")
    table = build((grammars / "mission.lark").read_text(encoding="utf-8"))
    (grammars / "mission.json").write_text(write(table), encoding="utf-8")
