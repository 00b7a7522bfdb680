"""Table-driven LALR parser that takes tokens one at a time and can report which tokens may come next."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple

from missionc.base.source import Span
from missionc.frontend.syntax.parse_table import END, Rule, Table


class Part(NamedTuple):
    """Value that the parser built for a part of the text, with its span (brackets included) and nesting depth."""

    value: object
    span: Span
    depth: int


class Ahead(NamedTuple):
    """Simulated effects of a token: reductions, which keep ``below`` of the parser states and push others.

    ``state`` is the state after the token.
    """

    state: int
    rules: list[Rule]
    below: int
    above: list[int]


REFUSED = Ahead(-1, [], 0, [])
"""Result of ``Machine._ahead`` for a token that is not allowed next."""


class TooDeepError(Exception):
    """Error: a node is nested deeper than the limit; ``part`` is a word in it."""

    def __init__(self, part: Part) -> None:
        super().__init__()
        self.part = part


class Machine:
    """Parser state for one text; nothing here recurses, however deep the text is nested.

    ``functions`` builds the node of each rule from its span and parts; rules named in ``nests`` lie one level deeper
    than their deepest part.
    """

    def __init__(
        self, table: Table, functions: Mapping[str, Callable[..., object]], nests: frozenset[str], nesting: int
    ) -> None:
        self._table = table
        self._functions = functions
        self._nests = nests
        self._nesting = nesting
        self._states = [0]
        self._parts: list[Part] = []

    def takes(self, kind: str) -> bool:
        """Return whether a token of this kind may come next."""
        return self._ahead(kind) is not REFUSED

    def expected(self) -> frozenset[str]:
        """Kinds of the tokens that may come next."""
        row = self._table.actions[self._states[-1]]
        return frozenset(kind for kind in (*row, END) if self.takes(kind))

    def feed(self, kind: str, value: object, span: Span) -> bool:
        """Take a token if it may come next, and return True; otherwise return False.

        Raises:
            TooDeepError: the text is nested more deeply than allowed.
        """
        ahead = self._ahead(kind)
        if ahead is REFUSED:
            return False
        self._reduce(ahead)
        self._states.append(ahead.state)
        self._parts.append(Part(value, span, 0))
        return True

    def finish(self) -> object:
        """Value of the complete text; the end must be allowed next."""
        self._reduce(self._ahead(END))
        return self._parts[0].value

    def _ahead(self, kind: str) -> Ahead:
        """Effects of a token, by simulation of all its reductions; ``REFUSED`` if it is not allowed next."""
        table, states = self._table, self._states
        actions, gotos, rules = table.actions, table.gotos, table.rules
        below, state = len(states), states[-1]
        above: list[int] = []
        reduced: list[Rule] = []
        while True:
            action = actions[state].get(kind)
            if action is None:
                if kind != END or state != table.accept:
                    return REFUSED
                return Ahead(state, reduced, below, above)
            if action >= 0:
                return Ahead(action, reduced, below, above)
            rule = rules[-1 - action]
            for _ in range(rule.size):
                if above:
                    above.pop()
                else:
                    below -= 1
            state = gotos[above[-1] if above else states[below - 1]][rule.symbol]
            above.append(state)
            if rule.name:
                reduced.append(rule)

    def _reduce(self, ahead: Ahead) -> None:
        if not ahead.above:
            return
        self._states[ahead.below :] = ahead.above
        parts = self._parts
        for rule in ahead.rules:
            size = rule.size
            if size == 1:
                part = parts[-1]
                parts[-1] = self._part(rule, parts[-1:], part.span, part.depth)
            else:
                merged = parts[-size:]
                depth = max([part.depth for part in merged])
                parts[-size:] = [self._part(rule, merged, merged[0].span.to(merged[-1].span), depth)]

    def _part(self, rule: Rule, parts: list[Part], span: Span, depth: int) -> Part:
        if rule.name in self._nests:
            depth += 1
            if depth > self._nesting:
                raise TooDeepError(next(part for part in parts if part.depth == 0 or part is parts[-1]))
        arguments: list[object] = []
        for place in rule.keep:
            value = None if place < 0 else parts[place].value
            if not isinstance(value, list):
                arguments.append(value)
            elif arguments:
                arguments.extend(value)
            else:
                arguments = value  # a list that grows by one item each time, without copies
        return Part(arguments if rule.name == "*" else self._functions[rule.name](span, *arguments), span, depth)
