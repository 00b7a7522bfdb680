"""Encoding of [strel] in Z3's terms: paths of each agent, and the specification unrolled over steps and routes.

    in   a problem in JSON: states, transitions, links, and the specification
    out  a model, or that there is none

``Z(φ, i)`` is a Python function of an agent and a step, not a ``z3.Lambda``. The paper's λ-terms bind a state *s* and
pass it unchanged to other steps. They mean the agent's state at that step, ``x[i][t]``; this variable must be known
when the term is made. Equal terms are made once.

Source:
    [strel] Symbolic Encoding of the Planning Problem, Algorithm 2.
"""

from __future__ import annotations

import itertools
from collections import defaultdict
from collections.abc import Iterator
from typing import Any

import z3


class Encoding:
    """Z3 terms over an integer ``x[agent][step]``, the index of the agent's state."""

    def __init__(self, problem: dict[str, Any]) -> None:
        self.steps: int = problem["steps"]
        self.prms: list[dict[str, Any]] = problem["prms"]
        self.collisions = [(one, other, grouped(moves)) for one, other, moves in problem["collisions"]]
        self.links = {
            (graph, one, other): grouped(states)
            for graph, pairs in enumerate(problem["links"])
            for one, other, states in pairs
        }
        self.members: list[list[int]] = problem["members"]
        self.formulas: list[list[Any]] = problem["terms"]
        self.agents = range(len(self.prms))
        self.x = [[z3.Int(f"x_{agent}_{step}") for step in range(self.steps + 1)] for agent in self.agents]
        self.known: dict[tuple[object, ...], Any] = {}

    def plan(self) -> list[Any]:
        """Terms ``Ψ_motion`` and ``Ψ_spec`` for a solver."""
        motion = [term for agent in self.agents for term in self.path(agent)]
        for one, other, moves in self.collisions:
            motion += self.apart(one, other, moves)
        return [*motion, self.holds(len(self.formulas) - 1, 0, 0)]

    def path(self, agent: int) -> Iterator[Any]:
        """Yield the terms of ``Ψ_path``: the initial state, states of the roadmap, and its transitions."""
        prm = self.prms[agent]
        onward = grouped(prm["moves"])
        yield self.among(agent, 0, prm["starts"])
        for step in range(self.steps):
            yield self.among(agent, step, range(prm["states"]))
            yield self.paired((agent, step), (agent, step + 1), onward)

    def apart(self, one: int, other: int, moves: dict[int, list[int]]) -> Iterator[Any]:
        """Yield terms that no excluded pair of moves occurs in one step.

        The terms are an addition to the paper, which ignores collisions.
        """
        for step in range(self.steps):
            for own, others in moves.items():
                at_once = [self.moved(other, step, each) for each in others]
                yield z3.Not(z3.And(self.moved(one, step, own), z3.Or(at_once)))

    def moved(self, agent: int, step: int, move: int) -> Any:
        """Term that the agent makes this move of its roadmap from this step to the next."""
        key = ("moved", agent, step, move)
        if key not in self.known:
            source, target = self.prms[agent]["moves"][move]
            self.known[key] = z3.And(self.at(agent, step, source), self.at(agent, step + 1, target))
        return self.known[key]

    def at(self, agent: int, step: int, state: int) -> Any:
        key = (agent, step, state)
        if key not in self.known:
            self.known[key] = self.x[agent][step] == state
        return self.known[key]

    def among(self, agent: int, step: int, states: list[int] | range) -> Any:
        return z3.Or([self.at(agent, step, state) for state in states])

    def paired(self, one: tuple[int, int], other: tuple[int, int], pairs: dict[int, list[int]]) -> Any:
        """Term that two variables, by agent and step, have one of the pairs of values, grouped by the first value."""
        return z3.Or([z3.And(self.at(*one, first), self.among(*other, some)) for first, some in pairs.items()])

    def link(self, graph: int, one: int, other: int, step: int) -> Any:
        """Term ``Link``: the states of two agents share an edge of the ε-proximity graph."""
        one, other = sorted((one, other))
        key = ("link", graph, one, other, step)
        if key not in self.known:
            self.known[key] = self.paired((one, step), (other, step), self.links[graph, one, other])
        return self.known[key]

    def routes(self, graph: int, agent: int, low: int, high: int) -> Iterator[tuple[int, ...]]:
        """Yield the routes of distinct agents from ``agent`` with ``low`` to ``high`` links: ``a_0 = i`` and
        ``Distinct``."""
        members = self.members[graph]
        others = [other for other in members if other != agent] if agent in members else []
        for links in range(low, min(high, len(others)) + 1):
            for rest in itertools.permutations(others, links):
                yield (agent, *rest)

    def linked(self, graph: int, route: tuple[int, ...], step: int) -> list[Any]:
        return [self.link(graph, one, other, step) for one, other in itertools.pairwise(route)]

    def holds(self, formula: int, agent: int, step: int) -> Any:
        """Term ``Z(φ, i)`` of a formula for an agent at a step."""
        key = ("holds", formula, agent, step)
        if key not in self.known:
            self.known[key] = self.encoded(self.formulas[formula], agent, step)
        return self.known[key]

    def encoded(self, formula: list[Any], agent: int, step: int) -> Any:
        word, *parts = formula
        match word:
            case "states":
                return self.among(agent, step, parts[0][agent])
            case "agents":
                return z3.BoolVal(agent in parts[0])
            case "of":
                return self.holds(parts[1], parts[0], step)
            case "not":
                return z3.Not(self.holds(parts[0], agent, step))
            case "and":
                return z3.And([self.holds(part, agent, step) for part in parts[0]])
            case "or":
                return z3.Or([self.holds(part, agent, step) for part in parts[0]])
            case "eventually":
                body, low, high = parts
                return z3.Or([self.holds(body, agent, later) for later in self.window(step, low, high)])
            case "always":
                body, low, high = parts
                return z3.And([self.holds(body, agent, later) for later in self.window(step, low, high)])
            case "until":
                hold, end, low, high = parts
                return z3.Or([self.ended(hold, end, agent, step, last) for last in self.window(step, low, high)])
            case "reach":
                through, end, graph, low, high = parts
                return z3.Or(
                    [
                        z3.And(
                            self.linked(graph, route, step)
                            + [self.holds(through, each, step) for each in route[:-1]]
                            + [self.holds(end, route[-1], step)]
                        )
                        for route in self.routes(graph, agent, low, high)
                    ]
                )
            case "escape":
                body, graph, low, high = parts
                return z3.Or(
                    [
                        z3.And(self.linked(graph, route, step) + [self.holds(body, each, step) for each in route])
                        for route in self.routes(graph, agent, low, high)
                    ]
                )
            case _:
                raise ValueError(word)

    def window(self, step: int, low: int, high: int | None) -> range:
        return range(step + low, (self.steps if high is None else step + high) + 1)

    def ended(self, hold: int, end: int, agent: int, step: int, last: int) -> Any:
        """Term of an *until* that ends at step ``last``: the left side is true up to and including that step."""
        held = [self.holds(hold, agent, each) for each in range(step, last + 1)]
        return z3.And([self.holds(end, agent, last), *held])

    def states(self, model: Any) -> list[list[int]]:
        """States of each agent at the steps in a model."""
        return [[model.eval(x, model_completion=True).as_long() for x in row] for row in self.x]


def grouped(pairs: list[list[int]]) -> dict[int, list[int]]:
    """Second members of pairs, grouped by their first members."""
    groups: defaultdict[int, list[int]] = defaultdict(list)
    for first, second in pairs:
        groups[first].append(second)
    return groups
