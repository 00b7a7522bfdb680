"""Check of graphs and formations: enough agents, no sight past what moves, formations whose agents would not touch.

says MC506 MC507 MC508 MC530 MC536
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise
from operator import sub

from missionc.diagnostics.code import (
    FORMATION_TOO_SMALL,
    FORMATION_TOO_TIGHT,
    GRAPH_TOO_SMALL,
    ONE_WAY_LAMBDA2,
    SIGHT_PAST_MOTION,
)
from missionc.diagnostics.model import Diagnostic, Label
from missionc.ir import Connectivity, Formation, Graph, Holds, Mission, Obstacle, Sight, Still
from missionc.ir.pair_ranges import directed
from missionc.ir.wording import listed, metres, spaced
from missionc.language.walk_formulas import formulas

FEWEST = 2


def check_graphs(mission: Mission) -> list[Diagnostic]:
    """Graphs and formations that cannot be meant."""
    findings = [_small_graph(graph) for graph in mission.graphs if len(graph.agents) < FEWEST]
    moving = [obstacle for obstacle in mission.obstacles if not obstacle.constant]
    if moving:
        findings.extend(_past_motion(graph, moving) for graph in mission.graphs if isinstance(graph, Sight))
    if mission.solve.connectivity is Connectivity.LAMBDA2:
        findings.extend(_one_way(graph) for graph in _connected(mission) if directed(graph))
    for formation in mission.formations:
        if len(formation.agents) < FEWEST:
            findings.append(_small_formation(formation))
        else:
            tight = list(_tight(mission, formation))
            if tight:
                findings.append(_forbidden(mission, formation, *min(tight, key=lambda pair: pair[2]), len(tight)))
    return findings


def _connected(mission: Mission) -> list[Graph]:
    """The graphs that formulas call connected, as declared."""
    asked = {
        formula.predicate.graph.name
        for formula in formulas(mission)
        if isinstance(formula, Holds) and formula.predicate.graph is not None
    }
    return [graph for graph in mission.graphs if graph.name in asked]


def _tight(mission: Mission, formation: Formation) -> Iterator[tuple[int, int, float]]:
    """Pairs that the formation keeps too close, with the most it lets them be apart in metres."""
    for first, second, target, tolerance in _reaches(formation):
        spacing = mission.spacing(first, second)
        if isinstance(target, tuple):
            most = spacing.measured(target) + tolerance * max(1.0, spacing.flatness)
            if most <= spacing.sideways:
                yield first, second, math.hypot(*target) + tolerance
        elif target + tolerance <= spacing.least:
            yield first, second, target + tolerance


def _reaches(formation: Formation) -> Iterator[tuple[int, int, float | tuple[float, ...], float]]:
    """Where the formation has two agents see each other, or how far apart, and its tolerance in metres: the pair of
    each edge, and neighbours by offset."""
    tolerance = formation.tolerance
    offsets: list[tuple[tuple[float, ...], int]] = []
    for edge in formation.edges:
        yield edge.first, edge.second, edge.target, tolerance
        if isinstance(edge.target, tuple):
            offsets.append((edge.target, edge.second))
    offsets.sort()
    both = tolerance if formation.total else 2 * tolerance
    for (here, first), (there, second) in pairwise(offsets):
        yield first, second, tuple(map(sub, here, there)), both


# ------------------------------------------------------------------ messages


def _small_graph(graph: Graph) -> Diagnostic:
    return Diagnostic(
        GRAPH_TOO_SMALL,
        f"graph `{graph.name}` is over {_agents(len(graph.agents))}; a link takes two",
        Label(graph.span),
        help="name more agents after `over`, or leave the graph out",
    )


def _past_motion(graph: Graph, moving: list[Obstacle]) -> Diagnostic:
    names = listed([f"`{obstacle.name}`" for obstacle in moving])
    verbs = ["grow" if isinstance(each.motion, Still) else "move" for each in moving]
    does = " or ".join(sorted(set(verbs), reverse=True))
    return Diagnostic(
        SIGHT_PAST_MOTION,
        f"graph `{graph.name}` looks past obstacles, and {names} {does}{'s' if len(moving) == 1 else ''}",
        Label(graph.span),
        tuple(Label(obstacle.span, f"{verb}s") for obstacle, verb in zip(moving, verbs, strict=True)),
        notes=("a sight is the same at every step for agents at the same places: roadmaps are labelled with it once",),
        help="let the obstacle stand where it blocks the view, or link by `proximity`",
    )


def _one_way(graph: Graph) -> Diagnostic:
    return Diagnostic(
        ONE_WAY_LAMBDA2,
        f"`connectivity = lambda2` is of links that lead both ways; those of graph `{graph.name}` lead one way",
        Label(graph.span),
        notes=("λ₂ is an eigenvalue of the Laplacian, which is symmetric where every link leads back",),
        help="give each pair the same range both ways, or leave `connectivity` out: then links of the best trees count",
    )


def _small_formation(formation: Formation) -> Diagnostic:
    return Diagnostic(
        FORMATION_TOO_SMALL,
        f"formation `{formation.name}` is of {_agents(len(formation.agents))}; it takes two",
        Label(formation.span),
        help="form it of more agents, or leave the formation out",
    )


def _agents(count: int) -> str:
    return "one agent" if count == 1 else "no agent"


def _forbidden(mission: Mission, formation: Formation, first: int, second: int, apart: float, pairs: int) -> Diagnostic:
    one, other = mission.agents[first], mission.agents[second]
    needed = mission.spacing(first, second)
    takes = (
        f"the radii {metres(one.radius)} and {metres(other.radius)} and the separation {metres(mission.separation)}"
        f" take {spaced(needed)}, and agents never touch"
    )
    if needed.most > one.radius + other.radius + mission.separation:
        takes = f"what their vehicles keep from each other takes {spaced(needed)}, from centre to centre"
    more = () if pairs == 1 else (f"{pairs - 1:,} more {'pair' if pairs == 2 else 'pairs'} of it would be too close",)
    return Diagnostic(
        FORMATION_TOO_TIGHT,
        f"formation `{formation.name}` keeps `{one.name}` and `{other.name}` within {metres(apart)} of each other",
        Label(formation.span, f"with its tolerance of {metres(formation.tolerance)}"),
        notes=(takes, *more),
        help="space the formation more widely, or make the separation smaller",
    )
