"""The encoding of [strel] means what the paper says: by the monitor, and by exhaustive search over small roadmaps."""

from __future__ import annotations

import itertools
import random
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
import z3

from missionc import ir
from missionc.backends.smt.lift import lift
from missionc.backends.smt.paper.encode import Encoding
from missionc.backends.smt.paper.paper_run import node_links, problem, specify
from missionc.backends.smt.roadmap.roadmap import Roadmap
from missionc.ir.lower.expand import expand
from missionc.verification.monitoring.monitor import truth
from tests.support.resolved_missions import mission
from tests.support.small_roadmaps import roadmap_of

AGENTS, STEPS = 4, 3
LATEST = 1
"""The last step of a window, so that two windows within each other end in time."""

DEMO = f"""\
mission demo
time step 1 s, horizon {STEPS} s
world (0, 0) to (3, 3)
region base = box (0, 0) to (1.5, 3)
region field = box (0, 0) to (3, 1.5)
team drone[{AGENTS}] {{ dynamics single_integrator(speed <= 9 m/s)  start at (1, 1), (1, 2), (2, 1), (2, 2) }}
graph radio = proximity 1 m
"""


def formulas(draw: random.Random, depth: int, time: int = 2) -> tuple[str, str]:
    """A formula, and one that means in the language what the paper says of the first.

    Args:
        depth: of operators within each other at most.
        time: of those, windows.
    """
    if depth == 0:
        atom = draw.choice(["base", "field", "drone[0]", "true", "x >= 2 m"])
        return atom, atom
    kind = draw.choice(["boolean", "space", "time" if time else "space"])
    f, paper_f = formulas(draw, depth - 1, time - (kind == "time"))
    g, paper_g = formulas(draw, depth - 1, time - (kind == "time"))
    if kind == "boolean":
        word = draw.choice(["not", "and", "or", "implies"])
        return (
            (f"(not {f})", f"(not {paper_f})")
            if word == "not"
            else (f"({f} {word} {g})", f"({paper_f} {word} {paper_g})")
        )
    if kind == "time":
        low = draw.randint(0, LATEST)
        window = f"[{low} s, {draw.randint(low, LATEST)} s]"
        word = draw.choice(["eventually", "always", "until"])
        if word == "until":
            return f"({f} until{window} {g})", f"({paper_f} until{window} ({paper_f} and {paper_g}))"
        return f"({word}{window} {f})", f"({word}{window} {paper_f})"
    low, high = draw.choice([(0, 0), (0, 1), (0, 2), (1, 2), (2, 2), (2, 3)])
    bounds = f"[hops {low}..{high} on radio]"
    linked = f"[hops {max(low, 1)}..{high} on radio]"
    word = draw.choice(["reach", "escape", "somewhere", "everywhere", "surround"])
    if word == "reach":
        return f"({f} reach{bounds} {g})", reached(paper_f, paper_g, low, high)
    if word == "escape":
        return f"(escape{bounds} {f})", f"({paper_f})" if low == 0 else f"({paper_f} reach{bounds} {paper_f})"
    if word == "surround":
        out = reached(paper_f, f"(not ({paper_f} or {paper_g}))", 1, high)
        far = reached(paper_f, paper_f, high + 1, AGENTS - 1)
        return f"({f} surround[hops 0..{high} on radio] {g})", f"({paper_f} and not {out} and not {far})"
    some = f"(somewhere{linked} {paper_f if word == 'somewhere' else f'(not {paper_f})'})" if high else "false"
    return f"({word}{bounds} {f})", some if word == "somewhere" else f"(not {some})"


def reached(through: str, end: str, low: int, high: int) -> str:
    """A route of so many links, one at least."""
    low = max(low, 1)
    return f"({through} reach[hops {low}..{high} on radio] {end})" if low <= high else "false"


def encoding_of(meant: ir.Mission, prms: tuple[Roadmap, ...], collisions: object = ()) -> Encoding:
    """Of the first requirement alone."""
    spec = specify(replace(meant, requirements=meant.requirements[:1]), prms)
    return Encoding(problem(spec, prms, [node_links(graph, prms) for graph in spec.graphs], list(collisions)))  # type: ignore[call-overload]


def model_of(encoding: Encoding) -> np.ndarray | None:
    solver = z3.Solver()
    solver.add(*encoding.plan())
    return np.array(encoding.states(solver.model())) if solver.check() == z3.sat else None


def small(draw: random.Random) -> tuple[Roadmap, ...]:
    """A roadmap of three places for each agent, and one to start; two agents have a choice of two moves from each."""
    made = []
    for agent in range(AGENTS):
        places = [(draw.uniform(0, 3), draw.uniform(0, 3)) for _ in range(3)]
        moves = [[at, to] for at in range(3) for to in sorted(draw.sample(range(3), 2 if agent < 2 else 1))]
        prm = roadmap_of((agent,), places, STEPS)
        made.append(replace(prm, moves=np.array(moves), starts=(np.array([draw.randrange(3)]),)))
    return tuple(made)


def paths(prm: Roadmap) -> Iterator[tuple[int, ...]]:
    """All paths of one roadmap from its start."""
    onward = {(int(source), int(target)) for source, target in prm.moves}
    for path in itertools.product(range(len(prm.position)), repeat=STEPS + 1):
        if path[0] in prm.starts[0] and all(move in onward for move in itertools.pairwise(path)):
            yield path


@pytest.mark.parametrize("seed", range(24))
def test_a_motion_satisfies_the_encoding_where_the_monitor_says_what_the_paper_means(seed: int) -> None:
    """A roadmap that is one path leaves Z3 one motion: it is satisfiable exactly where the formula holds of that."""
    draw = random.Random(seed)
    written, paper = formulas(draw, 3)
    meant = mission(f"{DEMO}require a: drone[0]: {written}\nrequire b: drone[0]: {paper}")
    kernel, _ = expand(meant)
    assert kernel is not None
    for _ in range(3):
        chain = np.array([(at, at + 1) for at in range(STEPS)])
        prms = tuple(
            replace(
                roadmap_of((agent,), [(draw.uniform(0, 3), draw.uniform(0, 3)) for _ in range(STEPS + 1)], STEPS),
                moves=chain,
                starts=(np.array([0]),),
            )
            for agent in range(AGENTS)
        )
        motion = lift(np.tile(np.arange(STEPS + 1), (AGENTS, 1)), prms, meant)
        held = bool(truth(kernel.requirements[1].formula, meant, motion)[0, 0])
        assert (model_of(encoding_of(meant, prms)) is not None) == held, (written, paper)


@pytest.mark.parametrize("seed", range(8))
def test_z3_finds_a_model_exactly_where_some_joint_motion_satisfies_the_formula(seed: int) -> None:
    draw = random.Random(100 + seed)
    written, paper = formulas(draw, 3)
    meant = mission(f"{DEMO}require a: drone[0]: {written}\nrequire b: drone[0]: {paper}")
    kernel, _ = expand(meant)
    assert kernel is not None
    prms = small(draw)
    goal = kernel.requirements[1].formula
    model = model_of(encoding_of(meant, prms))
    if model is not None:
        assert all(tuple(row) in set(paths(prm)) for row, prm in zip(model.tolist(), prms, strict=True))
        assert truth(goal, meant, lift(model, prms, meant))[0, 0]
    else:
        every = itertools.product(*map(paths, prms))
        assert not any(truth(goal, meant, lift(np.array(rows), prms, meant))[0, 0] for rows in every)


def test_moves_that_collide_are_excluded_only_where_that_is_asked() -> None:
    """Two agents swap places: each has one way, and they meet halfway."""
    meant = mission(f"{DEMO}require a: drone[0]: true")
    swap = [roadmap_of((agent,), [(0.0, agent), (1.0, agent)], STEPS) for agent in range(AGENTS)]
    chain = np.array([[0, 1], [1, 0]])
    prms = tuple(replace(prm, moves=chain, starts=(np.array([0]),)) for prm in swap)
    assert model_of(encoding_of(meant, prms)) is not None
    assert model_of(encoding_of(meant, prms, [(0, 1, [[1, 1]])])) is None
    assert model_of(encoding_of(meant, prms, [(0, 1, [[0, 1], [1, 0]])])) is not None
