"""The explanation of a requirement: as a value, as text and as a document, with the conventions that its formula uses.

    in   Mission, and the backend chosen for it
    out  Explained, lines, a JSON document

Teams that take off from the floor get sentences on their pads, altitudes, speeds and landing. Traps are conventions of
a formula that other tools read differently. Each comes with its example, in the order of ``convention_examples``.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import replace
from itertools import groupby, islice
from textwrap import wrap

from missionc import ir
from missionc.backends.choose_backend import Choice, needs_of
from missionc.backends.registry import BACKENDS
from missionc.base.late_dataclass import Record
from missionc.base.source import Turn
from missionc.base.trace import counted
from missionc.frontend.checks.check_horizons import steps_ahead
from missionc.frontend.explain.convention_examples import TRAPS, Example, Trap
from missionc.frontend.explain.phrases import names
from missionc.frontend.explain.sentences import Sentences, for_each_index, sentences, with_indices
from missionc.frontend.explain.window_diagram import WIDTH, Span, draw, windows
from missionc.frontend.resolve.show_ir import number_text
from missionc.ir.couplings import directed
from missionc.ir.language.operators import by_name
from missionc.ir.language.walk_formulas import as_written, formulas_bottom_up, goals, reaches_back
from missionc.ir.wording import all_listed, listed, metres, seconds


def flights_said(mission: ir.Mission) -> list[str]:
    """Sentences on takeoff and landing, one for each team with ``flight``."""
    teams: dict[str, list[ir.Agent]] = {}
    for agent in mission.agents:
        if agent.pad is not None:
            teams.setdefault(agent.team, []).append(agent)
    return [_said(mission, name, agents) for name, agents in teams.items()]


def _said(mission: ir.Mission, name: str, agents: list[ir.Agent]) -> str:
    pad = agents[0].pad
    assert pad is not None
    where = "from the floor below its starts" if pad.point is None else "from its pads"
    heights = {_height(mission, agent) for agent in agents}
    high = heights.pop() if len(heights) == 1 else None
    up = "to the height of its starts" if high is None else f"to {metres(high)}"
    fast = "" if math.isinf(pad.rise) else f" at {number_text(pad.rise)} m/s at most"
    slow = "" if math.isinf(pad.land) else f" at {number_text(pad.land)} m/s at most"
    return f"`{name}` takes off {where} {up}{fast}, and returns to land there{slow}"


def _height(mission: ir.Mission, agent: ir.Agent) -> float | None:
    """Flight altitude of an agent, metres; None if it depends on the plan."""
    if mission.dimension < 3:
        return float(agent.altitude)
    if agent.pad is not None and agent.pad.hover is not None:
        return agent.pad.hover
    return agent.start.point[2] if agent.start.point is not None else None


def traps_of(formula: ir.Formula) -> tuple[Trap, ...]:
    """Conventions used by the formula that other tools read differently, each once."""
    names: set[str] = set()
    windowed: set[ir.Formula] = set()
    for part in formulas_bottom_up([formula], as_written):
        names.update(_touched(part))
        below = any(operand in windowed for operand in as_written(part))
        window = isinstance(part, ir.Apply) and isinstance(part.bounds, ir.Window) and not reaches_back(part)
        if window and below:
            names.add("windows are not clipped")
        if window or below:
            windowed.add(part)
    return tuple(trap for trap in TRAPS if trap.name in names)


def _touched(part: ir.Formula) -> Iterator[str]:
    match part:
        case ir.Holds(predicate):
            if predicate.region:
                yield "borders belong to regions"
            if predicate.graph:
                yield "links are strict"
        case ir.Apply(operator, _, bounds):
            yield from by_name[operator.name].traps(part)
            if isinstance(bounds, ir.Length):
                yield "links are strict"
            elif isinstance(bounds, ir.Window) and bounds.high is not None:
                yield "windows are closed"
        case _:
            return


def table(example: Example) -> list[str]:
    """Lines of a table for an example: a line for each formula, a column for each step or agent, then the two
    readings.
    """
    count = len(example.places) if example.agents else len(example.places[0])
    heads = [f"a[{index}]" if example.agents else f"{index} s" for index in range(count)]
    wide = max(len(name) for name, _ in example.rows)
    lines = [f"{'':{wide}}  {'  '.join(f'{head:>4}' for head in heads)}"]
    for name, cells in example.rows:
        lines.append(f"{name:{wide}}  {'  '.join(f'{_word(cell):>4}' for cell in cells)}")
    if example.agents:
        lines.append(f"{'linked':{wide}}  {', '.join(linked(example)) or 'none'}")
    first, second = (example.holds, not example.holds)
    asked, otherwise = _shown(example.asked), _shown(example.otherwise)
    wide = max(len(asked), len(otherwise))
    lines.append(f"{asked:{wide}}  {str(first).lower()}, convention of missionc")
    lines.append(f"{otherwise:{wide}}  {str(second).lower()}, other convention")
    return lines


def _shown(formula: str) -> str:
    """Text of a formula in a table, without the agent `a[0]` and the only graph."""
    bare = formula.removeprefix("a[0]: ").replace(" on radio", "")
    return bare[1:-1] if bare != formula and bare.startswith("(") and bare.endswith(")") else bare


def linked(example: Example) -> list[str]:
    """Texts of the links of an example at one step: pairs of agents less than 1 m apart."""
    places = [path[0] for path in example.places]
    pairs = [(one, other) for other in range(len(places)) for one in range(other)]
    return [f"a[{one}]-a[{other}]" for one, other in sorted(pairs) if math.dist(places[one], places[other]) < 1]


def _word(cell: str) -> str:
    return "yes" if cell == "T" else "no"


class Explained(Record, eq=False):
    """Explanation of a requirement, or of a preference with its ``weight``.

    ``needed`` is the minimum number of steps of the mission, infinite if no number suffices; ``looks`` is the last step
    of this mission that it depends on.
    """

    name: str
    weight: float | None
    line: int
    written: str
    said: Sentences
    things: tuple[str, ...]
    windows: tuple[Span, ...]
    needed: float
    looks: int
    needs: tuple[str, ...]
    backends: tuple[str, ...]
    traps: tuple[Trap, ...]
    turns: tuple[Turn, ...] = ()
    """Indices of the requirement as a member of a family."""


MOST_GOALS = 100
"""Maximum number of requirements and preferences on one page."""

MOST_LETTERS = 100_000
"""Maximum number of letters in the sentences of one page; the rest is omitted."""

MOST_WINDOWS = 10_000
"""Maximum number of windows of one formula that are searched."""


def explained(mission: ir.Mission, name: str | None = None) -> tuple[Explained, ...]:
    """Explanations of every requirement, then of every preference, or of the one with a name; limited to one page."""
    parts: list[Explained] = []
    letters = 0
    for goal in (goal for goal in goals(mission) if name in (None, goal.name)):
        if len(parts) == MOST_GOALS or letters > MOST_LETTERS:
            break
        parts.append(_explained(mission, goal))
        letters += parts[-1].said.letters
    return tuple(parts)


def left_out(parts: tuple[Explained, ...], mission: ir.Mission) -> int:
    """Number of requirements and preferences that do not fit on a page; 0 for a page about one of them."""
    total = len(list(goals(mission)))
    full = len(parts) == MOST_GOALS or sum(part.said.letters for part in parts) > MOST_LETTERS
    return total - len(parts) if full and len(parts) > 1 else 0


def _explained(mission: ir.Mission, goal: ir.Requirement | ir.Preference) -> Explained:
    spans = tuple(islice(windows(goal.formula, mission), MOST_WINDOWS))
    if any(part.span.turns for part in formulas_bottom_up([goal.formula], as_written)):
        spans = tuple({span.drawn: span for span in spans}.values())  # once, whatever the index is
    required = needs_of(goal.formula)
    features = {need.feature for need in required}
    return Explained(
        goal.name,
        goal.weight if isinstance(goal, ir.Preference) else None,
        goal.span.source.place(goal.span.start)[0],
        " ".join(goal.formula.span.text.split()),
        sentences(goal.formula, mission),
        tuple(_things(goal.formula, mission)),
        spans,
        steps_ahead([goal.formula])[goal.formula].total,
        max((span.looks for span in spans), default=0),
        tuple(need.feature.value for need in required),
        tuple(name for name, spec in BACKENDS.items_built_in() if features <= spec.features),
        traps_of(goal.formula),
        goal.span.turns,
    )


def _things(formula: ir.Formula, mission: ir.Mission) -> Iterator[str]:
    """Yield descriptions of the graphs, formations, resources and flags that a formula names, one sentence for each
    family.
    """
    things = dict.fromkeys(thing for part in formulas_bottom_up([formula], as_written) for thing in _named(part))
    for _, alike in groupby(things, key=lambda thing: (thing.span.source.name, thing.span.start)):
        of_one_text = list(alike)
        said = [_thing(thing, mission) for thing in of_one_text]
        one = for_each_index(said, [thing.span.turns for thing in of_one_text])
        yield from said if one is None else [one]


def _thing(thing: ir.Graph | ir.Formation | ir.Resource | ir.Flag, mission: ir.Mission) -> str:
    match thing:
        case ir.Formation():
            return _formation(thing, mission)
        case ir.Resource():
            return _resource(thing, mission)
        case ir.Flag():
            cleared = f" and cleared in `{thing.cleared_in.name}`" if thing.cleared_in else ""
            return f"`{thing.name}` of {names(thing.agents, mission)} is set in `{thing.set_in.name}`{cleared}"
        case _:
            return _graph(thing, mission)


def _named(part: ir.Formula) -> Iterator[ir.Graph | ir.Formation | ir.Resource | ir.Flag]:
    match part:
        case ir.Apply(bounds=ir.Length(graph=graph)):
            yield graph
        case ir.Holds(ir.Flagged(flag)):
            yield flag
        case ir.Holds(ir.Compare(terms=terms)):
            yield from (each.resource for _, each in terms if isinstance(each, ir.Level))
        case ir.Holds(predicate):
            yield from (each for each in (predicate.graph, predicate.formation) if each)
        case _:
            return


def _resource(resource: ir.Resource, mission: ir.Mission) -> str:
    drains = [
        f"{number_text(drain)} for each {what}"
        for drain, what in ((resource.per_second, "second"), (resource.per_metre, "metre"))
        if drain
    ]
    parts = [f"starts at {number_text(resource.start)} and holds {number_text(resource.capacity)} at most"]
    parts += [f"loses {' and '.join(drains)}"] if drains else []
    parts += [
        f"gains {number_text(each.per_second)} for each second in `{each.region.name}`" for each in resource.refills
    ]
    return f"`{resource.name}` of {names(resource.agents, mission)} {'; it '.join(parts)}"


def _graph(graph: ir.Graph, mission: ir.Mission) -> str:
    return _links(graph, mission) + "".join(f"; {_weight(weight, mission)}" for weight in graph.weights)


def _weight(weight: ir.Weight, mission: ir.Mission) -> str:
    pairs = [
        f"{each.weight} from {names(tuple(sorted(each.senders)), mission)}"
        f" to {names(tuple(sorted(each.receivers)), mission)}"
        for each in weight.pairs
    ]
    others = f"{weight.others} between all others" if pairs else f"{weight.others}"
    return f"a link has `{weight.name}` {', '.join((*pairs, others))}"


def _links(graph: ir.Graph, mission: ir.Mission) -> str:
    if graph.ranges:
        return _graph_of_pairs(graph, mission)
    if isinstance(graph, ir.Proximity):
        return f"`{graph.name}` links two agents that are closer than {number_text(graph.radius)} m to each other"
    if isinstance(graph, ir.Sight):
        return (
            f"`{graph.name}` links two agents that are closer than {number_text(graph.radius)} m to each other, "
            "with no obstacle on the straight line between them"
        )
    return f"`{graph.name}` links two agents that are both closer than {number_text(graph.radius)} m to one beacon"


def _graph_of_pairs(graph: ir.Graph, mission: ir.Mission) -> str:
    ways = [
        f"closer than {number_text(each.radius)} m from {names(tuple(sorted(each.senders)), mission)}"
        f" to {names(tuple(sorted(each.receivers)), mission)}"
        for each in graph.ranges
    ]
    ways += [f"closer than {number_text(graph.radius)} m between all others"] if graph.radius > 0 else []
    rest = "" if graph.radius > 0 else "; no others are linked"
    seen = ", with no obstacle on the straight line between them" if isinstance(graph, ir.Sight) else ""
    leads = "; links are directed" if directed(graph) else ""
    return f"`{graph.name}` links one agent to another that is {', '.join(ways)}{seen}{rest}{leads}"


def _formation(formation: ir.Formation, mission: ir.Mission) -> str:
    if formation.kind == "distances":
        return f"`{formation.name}` fixes distances within {names(formation.agents, mission)}"
    return f"`{formation.name}` is a {formation.kind} of {names(formation.agents, mission)}"


def _growths(mission: ir.Mission) -> list[str]:
    """Sentences on the growth of uncertain obstacles over time."""
    return [
        f"obstacle `{obstacle.name}` grows by {number_text(obstacle.growth)} m on all sides each second, "
        f"by {number_text(obstacle.grown(mission.horizon))} m until the end"
        for obstacle in mission.obstacles
        if obstacle.growth
    ]


def _tolerances(mission: ir.Mission) -> list[str]:
    """Sentences on the required delay tolerance of each set of agents."""
    return [
        f"one agent of {names(each.agents, mission)} may be late by up to {seconds(mission, each.steps)}, with all "
        "others on time; every requirement stays satisfied"
        for each in mission.tolerances
    ]


# ---------------------------------------------------------------------- text


def lines(parts: tuple[Explained, ...], mission: ir.Mission, choice: Choice | None, unicode: bool) -> list[str]:
    """Lines of an explanation page, at most ``WIDTH`` columns wide except for text by the author."""
    agents, steps = counted(len(mission.agents), "agent"), counted(mission.steps, "step")
    page = [f"mission {mission.name}: {agents}, {steps} of {number_text(mission.step)} s"]
    for said in (*flights_said(mission), *_growths(mission), *_tolerances(mission)):
        page += _wrapped(f"{said}.", 2, 4)
    for _, alike in groupby(parts, key=lambda part: (part.weight is None, part.line, part.turns == ())):
        of_one_text = tuple(alike)
        for part in of_family(of_one_text) or of_one_text:
            page += ["", *_part_lines(part, mission, unicode)]
    if left := left_out(parts, mission):
        more = f"{left} more not shown; explain a requirement with `missionc explain FILE NAME`"
        page += ["", more]
    if choice is not None:
        page += ["", *choice.explanation.rstrip("\n").split("\n")]
    known = {trap.name: trap for part in parts for trap in part.traps}
    if known:
        page += ["", "conventions that differ elsewhere:"]
    for trap in known.values():
        page += ["", *_wrapped(f"{trap.name}: {trap.says}. Elsewhere: {trap.elsewhere}.", 2, 4)]
        page += [f"      {line}" for line in table(trap.example)]
    return page


def of_family(parts: tuple[Explained, ...]) -> tuple[Explained, ...]:
    """Explanations of a family's members as one explanation with an index.

    Empty if they differ in more than indices.
    """
    turns, first = [part.turns for part in parts], parts[0]
    alike = len({(tuple(span.drawn for span in part.windows), part.needed, part.looks) for part in parts}) == 1
    if not alike or not first.turns or any(part.said.parts or part.things != first.things for part in parts):
        return ()
    name = with_indices([f"`{part.name}`" for part in parts], turns)
    said = for_each_index([part.said.whole for part in parts], turns)
    return (replace(first, name=name.strip("`"), said=Sentences(said)),) if name and said else ()


def _part_lines(part: Explained, mission: ir.Mission, unicode: bool) -> Iterator[str]:
    word, weight = ("require", "") if part.weight is None else ("prefer", f", weight {number_text(part.weight)}")
    yield f"{word} {part.name} (line {part.line}{weight})"
    yield from _wrapped(part.said.whole, 2)
    for more in part.said.parts:
        yield from _wrapped(more.sentence, 4)
    if part.said.left_out:
        yield from _wrapped(f"At least {part.said.left_out} more definitions are not shown.", 4)
    for thing in part.things:
        yield from _wrapped(f"{thing}.", 4)
    drawing = draw(iter(part.windows), mission, unicode)
    yield from ["", *(f"  {line}" for line in drawing), ""] if drawing else []
    yield from _wrapped(f"time: {_horizon(part, mission)}", 2, 4)
    if part.needs:
        who = listed(part.backends) if part.backends else "no backend"
        yield from _wrapped(f"needs {all_listed(part.needs)}; {who} can express that", 2, 4)
    if part.traps:
        yield from _wrapped(f"conventions that differ elsewhere: {'; '.join(trap.name for trap in part.traps)}", 2, 4)


def _horizon(part: Explained, mission: ir.Mission) -> str:
    lasts = seconds(mission, mission.steps)
    if math.isinf(part.needed):
        return f"no horizon is long enough; the mission lasts {lasts}"
    far = seconds(mission, part.looks)
    return (
        f"depends on states up to {far}, needs a horizon of {seconds(mission, part.needed)}; the mission lasts {lasts}"
    )


def _wrapped(text: str, indent: int, more: int | None = None) -> list[str]:
    return wrap(
        text,
        WIDTH,
        initial_indent=" " * indent,
        subsequent_indent=" " * (indent if more is None else more),
        break_long_words=False,
        break_on_hyphens=False,
    )


# ---------------------------------------------------------------------- JSON


def document(parts: Iterable[Explained], mission: ir.Mission, choice: Choice | None) -> dict[str, object]:
    """JSON document with the content of the page; times are in steps, and the step is in seconds."""
    parts = tuple(parts)
    traps = {trap.name: trap for part in parts for trap in part.traps}
    return {
        "mission": mission.name,
        "step": mission.step,
        "steps": mission.steps,
        "flights": flights_said(mission),
        "obstacles": _growths(mission),
        "tolerances": _tolerances(mission),
        "backend": None if choice is None else choice.backend,
        "backend_because": None if choice is None else choice.explanation,
        "goals": [_goal(part) for part in parts],
        "goals_left_out": left_out(parts, mission),
        "traps": [_trap(trap) for trap in traps.values()],
    }


def _goal(part: Explained) -> dict[str, object]:
    return {
        "name": part.name,
        "kind": "requirement" if part.weight is None else "preference",
        "weight": part.weight,
        "line": part.line,
        "formula": part.written,
        "sentence": part.said.whole,
        "where": [{"name": more.name, "sentence": more.sentence} for more in part.said.parts],
        "where_left_out": part.said.left_out,
        "things": list(part.things),
        "windows": [_window(span) for span in part.windows],
        "needs_steps": part.needed if math.isfinite(part.needed) else None,
        "looks_to_step": part.looks,
        "needs": list(part.needs),
        "backends": list(part.backends),
        "traps": [trap.name for trap in part.traps],
    }


def _window(span: Span) -> dict[str, object]:
    return {"words": span.words, "depth": span.depth, "first": list(span.first), "last": list(span.last)}


def _trap(trap: Trap) -> dict[str, object]:
    example = trap.example
    return {
        "name": trap.name,
        "says": trap.says,
        "elsewhere": trap.elsewhere,
        "columns": "agents" if example.agents else "steps",
        "rows": [{"formula": name, "holds": [cell == "T" for cell in cells]} for name, cells in example.rows],
        "positions": [[list(point) for point in path] for path in example.places],
        "asked": {"formula": example.asked, "holds": example.holds},
        "otherwise": {"formula": example.otherwise, "holds": not example.holds},
    }
