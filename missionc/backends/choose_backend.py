"""Choice of the backends for a mission: they must support the features that the mission needs.

    in   Mission, and a backend by name if the command line gives one
    out  Choice
    says MC401 MC402

The module uses only tables of names and loads no solver.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import assert_never

from missionc.backends.features import Feature
from missionc.backends.registry import AUTO, BACKENDS
from missionc.base.diagnostics.code import CANNOT_EXPRESS, NO_BACKEND
from missionc.base.diagnostics.defect import extension_error
from missionc.base.diagnostics.model import Diagnostic, Label
from missionc.base.extensions import ExtensionError
from missionc.base.late_dataclass import Record
from missionc.base.source import Span
from missionc.base.units import Metric
from missionc.ir import Apply, Flagged, Formula, Holds, Length, Mission, Objective, Still
from missionc.ir.language.walk_formulas import asks_the_past, formulas, formulas_bottom_up, operator_words
from missionc.ir.predicates import PlacePredicate
from missionc.ir.wording import listed


class Need(Record):
    """Feature that a mission needs, with the source text that needs it."""

    feature: Feature
    span: Span


class Choice(Record):
    """Backends that will plan the mission, in the order of their turns.

    ``explanation`` states why these backends are used, and why the others are not.
    """

    engines: tuple[str, ...]
    explanation: str

    @property
    def backend(self) -> str:
        """Name of the backend with the first turn."""
        return self.engines[0]


def choose_backend(mission: Mission, forced: str | None) -> tuple[Choice | None, list[Diagnostic]]:
    """Backend that the mission or the command line names, or else all backends that support the mission.

    Returns:
        the choice, or None if no backend can plan the mission; and findings.
    """
    wanted = forced or mission.solve.backend
    required = needs(mission)
    specs = dict(BACKENDS.items_built_in())
    try:
        named = None if wanted == AUTO else BACKENDS.get(wanted)
    except ExtensionError as error:
        return None, [extension_error(error, mission.solve.span if wanted == mission.solve.backend else None)]
    specs |= {wanted: named} if named else {}
    able = [name for name, spec in specs.items() if all(need.feature in spec.features for need in required)]
    if wanted == AUTO and not able:
        return None, [_none_can(mission, required)]
    if wanted != AUTO and wanted not in able:
        return None, [_cannot(mission, wanted, able, need) for need in _missing(wanted, required)]
    chosen = _in_order(able, required) if wanted == AUTO else (wanted,)
    return Choice(chosen, _explain(mission, forced, chosen, required)), []


def _in_order(able: list[str], required: tuple[Need, ...]) -> tuple[str, ...]:
    """Backends in the order of their turns: first the backends preferred for a required feature, last the backends that
    repeat the attempts of others."""
    asked = {need.feature for need in required}
    return tuple(
        sorted(able, key=lambda name: (BACKENDS[name].subsumes in able, BACKENDS[name].preferred_for.isdisjoint(asked)))
    )


def needs(mission: Mission) -> tuple[Need, ...]:
    """Features that the mission needs, each once, at the first source text that needs it."""
    return _once((*_of_world(mission), *_of_goals(mission), *_of_objective(mission), *_of_solve(mission)))


def needs_of(formula: Formula) -> tuple[Need, ...]:
    """Features that one formula needs, each once, at the first source text that needs it."""
    return _once(_of_formulas(formulas_bottom_up([formula])))


def _once(required: Iterable[Need]) -> tuple[Need, ...]:
    first: dict[Feature, Need] = {}
    for need in required:
        first.setdefault(need.feature, need)
    return tuple(sorted(first.values(), key=lambda need: need.span.start))


def _of_world(mission: Mission) -> Iterator[Need]:
    if mission.dimension == 3:
        yield Need(Feature.VOLUME, mission.world.span)
    for obstacle in mission.obstacles:
        if not isinstance(obstacle.motion, Still):
            yield Need(Feature.MOVING_OBSTACLE, obstacle.span)
        if obstacle.growth:
            yield Need(Feature.UNCERTAIN_OBSTACLE, obstacle.span)
    for tolerance in mission.tolerances:
        yield Need(Feature.DELAY, tolerance.span)
    for agent in mission.agents:
        if agent.dynamics.has_momentum:
            yield Need(Feature.SECOND_ORDER, agent.span)
        if agent.dynamics.lowest_speed > 0:
            yield Need(Feature.LEAST_SPEED, agent.span)
        if agent.dynamics.rules:
            yield Need(Feature.EXTENSION_RULES, agent.span)
        if agent.dynamics.faces_ahead:
            yield Need(Feature.UNICYCLE, agent.span)


def _of_goals(mission: Mission) -> Iterator[Need]:
    yield from _of_formulas(formulas(mission))
    for preference in mission.preferences:
        yield Need(Feature.PREFER, preference.span)


def _of_formulas(all_of_them: Iterable[Formula]) -> list[Need]:
    """Features that formulas need, in the order of the formulas in the text."""
    needs = [(formula.span.start, need) for formula in all_of_them for need in _of_formula(formula)]
    return [need for _, need in sorted(needs, key=lambda pair: pair[0])]


def _of_formula(formula: Formula) -> Iterator[Need]:
    match formula:
        case Apply(bounds=Length(metric=Metric.HOPS | Metric.WEIGHT)):
            yield Need(Feature.HOPS, operator_words(formula))
        case Apply(bounds=Length()):
            yield Need(Feature.METRIC_LENGTH, operator_words(formula))
            if past := next(filter(asks_the_past, formulas_bottom_up(formula.operands)), None):
                yield Need(Feature.PAST_BELOW_METRES, operator_words(past))
        case Holds(predicate, span):
            if predicate.graph:
                yield Need(Feature.CONNECTED, span)
            if predicate.reads_past:
                yield Need(Feature.FLAG if isinstance(predicate, Flagged) else Feature.RESOURCE, span)
            if predicate.reads_heading:
                yield Need(Feature.HEADING, span)
            if isinstance(predicate, PlacePredicate):
                yield Need(Feature.EXTENSION_PREDICATE, span)
            if predicate.formation:
                yield Need(Feature.TOTAL_TOLERANCE if predicate.formation.total else Feature.FORMATION, span)
        case _:
            return


def _of_objective(mission: Mission) -> Iterator[Need]:
    span = mission.objective_span or mission.span
    match mission.objective:
        case Objective.DISTANCE:
            yield Need(Feature.DISTANCE, span)
        case Objective.DURATION:
            yield Need(Feature.RESTLESS_DURATION if _restless(mission) else Feature.DURATION, span)
        case Objective.ENERGY:
            yield Need(Feature.ENERGY, span)
        case Objective.ROBUSTNESS:
            yield Need(Feature.ROBUSTNESS, span)
        case Objective.NONE:
            return
        case _:
            assert_never(mission.objective)


def _of_solve(mission: Mission) -> Iterator[Need]:
    if mission.solve.roadmap is not None:
        yield Need(Feature.LANES, mission.solve.roadmap.span)


def _restless(mission: Mission) -> list[str]:
    """Names of the teams whose agents cannot wait."""
    moving = [agent.team for agent in mission.agents if agent.dynamics.lowest_speed > 0]
    return list(dict.fromkeys(moving))


def _missing(name: str, required: tuple[Need, ...]) -> list[Need]:
    offered = BACKENDS[name].features if name in BACKENDS else frozenset()
    return [need for need in required if need.feature not in offered]


# ------------------------------------------------------------------ messages


def _cannot(mission: Mission, wanted: str, able: list[str], need: Need) -> Diagnostic:
    restless = need.feature is Feature.RESTLESS_DURATION
    labels = (
        ()
        if mission.solve.span is None or mission.solve.backend != wanted
        else (Label(mission.solve.span, f"`{wanted}` chosen here"),)
    )
    return Diagnostic(
        CANNOT_EXPRESS,
        f"the backend `{wanted}` cannot express {need.feature.value}",
        Label(need.span),
        labels,
        (_who_cannot_wait(mission),) if restless else (),
        _allow_waiting(mission) if restless else _change(able, _able_extensions(needs(mission))),
    )


def _able_extensions(required: tuple[Need, ...]) -> list[str]:
    """Names of the extension backends that support all required features."""
    specs = [BACKENDS.usable(each.name) for each in BACKENDS.extensions()]
    return [spec.name for spec in specs if spec and all(need.feature in spec.features for need in required)]


def _change(able: list[str], foreign: list[str]) -> str:
    if not able and not foreign:
        return "delete this construct: no single backend can express the complete mission"
    auto = "write `solve with auto`, or " if able else ""
    return f"{auto}choose {' or '.join(f'`{name}`' for name in dict.fromkeys((*able, *foreign)))}, which can"


def _none_can(mission: Mission, required: tuple[Need, ...]) -> Diagnostic:
    """Finding that no built-in backend supports the mission: one label per unsupported feature, with the backends that
    lack it."""
    ruled = [
        (need, [name for name, spec in BACKENDS.items_built_in() if need.feature not in spec.features])
        for need in required
    ]
    labels = [
        Label(need.span, f"{need.feature.value} rules out {listed([f'`{name}`' for name in names])}")
        for need, names in sorted(ruled, key=lambda each: -len(each[1]))
        if names
    ]
    restless = any(need.feature is Feature.RESTLESS_DURATION for need in required)
    foreign = _able_extensions(required)
    return Diagnostic(
        NO_BACKEND,
        f"no single {'built-in ' if foreign else ''}backend can express this mission",
        labels[0],
        tuple(labels[1:]),
        (_who_cannot_wait(mission),) if restless else (),
        _change([], foreign) if foreign else _allow_waiting(mission) if restless else "delete one of these constructs",
    )


def _who_cannot_wait(mission: Mission) -> str:
    names = ", ".join(f"`{name}`" for name in _restless(mission))
    return f"{names} cannot wait, so every plan lasts for the whole horizon"


def _allow_waiting(mission: Mission) -> str:
    return f"let `{_restless(mission)[0]}` wait, with `speed 0..`"


def _explain(mission: Mission, forced: str | None, chosen: tuple[str, ...], required: tuple[Need, ...]) -> str:
    """Text of ``--emit backend``: the reasons for and against each backend."""
    by_need = (forced or mission.solve.backend) == AUTO
    if forced and not by_need:
        why = "the command line selects this backend"
    elif not by_need:
        why = f"the mission selects this backend{_where(mission.solve.span)}"
    elif len(chosen) > 1:
        why = "all these backends support the mission; they run in turns until a backend finds a plan"
    else:
        why = "this backend supports the mission"
    lines = [f"backend{'s' if len(chosen) > 1 else ''}: {', '.join(chosen)}", f"because {why}"]
    for name in BACKENDS.built_in:
        if name not in chosen:
            lines.extend(_not_taken(name, required, chosen))
    lines.append("the mission needs:" if required else "the mission needs no special feature")
    lines.extend(f"  {need.feature.value}{_where(need.span)}" for need in required)
    return "\n".join(lines) + "\n"


def _not_taken(name: str, required: tuple[Need, ...], chosen: tuple[str, ...]) -> Iterator[str]:
    missing = _missing(name, required)
    if not missing:
        yield f"not {name}: this backend supports the mission, but {chosen[0]} is selected"
        return
    yield f"not {name}: this backend cannot express"
    for need in missing:
        yield f"  {need.feature.value}{_where(need.span)}"


def _where(span: Span | None) -> str:
    """Line and text of a source location: `` (line 18: `reach[hops 0..2 on radio]`)``."""
    if span is None:
        return ""
    words = " ".join(span.text.split())
    line, _ = span.source.place(span.start)
    return f" (line {line}: `{words if len(words) <= 60 else words[:59] + '…'}`)"
