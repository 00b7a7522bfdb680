"""Rest of a mission in flight: checked, progressed, and ready for planning or verification.

in   Checked, the Past
out  Checked of the rest: its mission begins where the past ends
says MC719 MC723
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from missionc.base.diagnostics.code import NOT_SAID, PAST_DOES_NOT_FIT
from missionc.base.diagnostics.model import Diagnostic, Label
from missionc.base.limits import Limits
from missionc.base.trace import Trace
from missionc.compiler.front_end import ANY_BACKEND, Checked, check
from missionc.compiler.provenance import inputs
from missionc.frontend.syntax.read_file import held
from missionc.ir import Mission
from missionc.planning.progression.formula_progression import NotProgressableError
from missionc.planning.progression.past_document import Past
from missionc.planning.progression.stretches import Remaining, after
from missionc.verification.certificate import Certificate

if TYPE_CHECKING:
    from missionc.verification.flight.verify_stops import Stops


def remaining(checked: Checked, past: Past, limits: Limits) -> Checked | Diagnostic:
    """Checked mission that remains after its past, or a diagnostic.

    ``rest`` has the details; ``mission`` and ``kernel`` are the remaining ones.

    Args:
        checked: complete mission of the present text.
    """
    written: list[Mission] = []
    rest: Remaining | None = None
    for flown in past.flown:
        then = earlier(checked, flown.texts, limits) if flown.texts else checked
        if then.mission is None or then.kernel is None:
            return unfit("its mission has errors")
        written.append(then.mission)
        rest = rest or Remaining(then.mission, then.kernel)
    assert rest is not None
    for number, flown in enumerate(past.flown):
        if flown.agents != tuple(agent.name for agent in rest.mission.agents):
            return unfit("its agents differ from those of the mission")
        if abs(flown.stretch.trace.step - rest.mission.step) > 1e-9 or flown.stretch.steps >= rest.mission.steps:
            return unfit("its time steps differ from those of the mission, or none remain")
        if flown.stretch.trace.position.shape[2] != rest.mission.dimension:
            return unfit("the dimension of its states differs from that of the mission")
        now = written[number + 1] if number + 1 < len(written) else checked.valid_mission
        if wrong := _differ(rest.mission, now):
            return unfit(wrong)
        try:
            rest = after(rest, flown.stretch, now)
        except NotProgressableError as error:
            return not_said(error)
    same = not any(each.stretch.lost or each.stretch.given_up or each.stretch.slow or each.texts for each in past.flown)
    if same and checked.kernel is not None:
        rest = replace(
            rest, whole=(checked.valid_mission, checked.kernel), seen=tuple(each.stretch.trace for each in past.flown)
        )
    return replace(checked, mission=rest.mission, kernel=rest.kernel, rest=rest, past=past)


def without_home(checked: Checked) -> Checked:
    """Remaining mission without return to the pads, so that it ends in the air."""
    mission, past = checked.valid_mission, checked.past
    assert past is not None
    last = past.flown[-1]
    last = replace(last, stretch=replace(last.stretch, stays=True))
    agents = tuple(replace(agent, pad=None) for agent in mission.agents)
    return replace(checked, mission=replace(mission, agents=agents), past=replace(past, flown=(*past.flown[:-1], last)))


def whole_checks(rest: Remaining | None, plan: Trace) -> Certificate | None:
    """Checks of the requirements over past and plan together.

    None if the parts of the flight have no common mission.
    """
    if rest is None or rest.whole is None:
        return None
    from missionc.verification.plan.whole_requirements import check_whole  # judging plans loads scipy

    mission, kernel = rest.whole
    return Certificate(mission.name, tuple(check_whole(mission, kernel, rest.seen, plan)))


def stops_of(checked: Checked, files: Mapping[str, str]) -> Stops | None:
    """Stops before a remaining mission, from each agent's polynomials; None for a mission without a past."""
    if checked.past is None or checked.rest is None or checked.rest.stopping is None:
        return None
    from missionc.verification.flight.verify_stops import Stops

    mission, last = checked.rest.stopping, checked.past.flown[-1]
    rows = [last.agents.index(agent.name) for agent in mission.agents]
    told = last.stretch.trace.part(rows, 0, last.stretch.steps)
    return Stops(mission, told, last.until, last.begins, files)


def earlier(checked: Checked, texts: Mapping[str, str], limits: Limits) -> Checked:
    """The mission checked again with former texts of some of its files."""
    own = dict(inputs(checked))
    main = next(iter(own))
    own.update({name: text.encode() for name, text in texts.items() if name in own})
    source, load = held(main, str(Path(checked.file).parent), own, limits)
    if isinstance(source, Diagnostic):
        return Checked(checked.file, (source,))
    return check(
        source,
        overrides=checked.overrides,
        backend=ANY_BACKEND,
        limits=limits,
        stretch=checked.stretch,
        vehicle=checked.vehicle,
        poses=checked.poses,
        load=load,
        begun=True,
    )


def _differ(before: Mission, now: Mission) -> str:
    """Reason why a flight of the first mission cannot continue as the second one; empty if it can."""
    names = {agent.name for agent in now.agents}
    if any(agent.name not in names for agent in before.agents):
        return "the mission no longer has all of its agents"
    if before.step != now.step or before.dimension != now.dimension:
        return "the time step or the dimension of the mission has changed"
    return ""


def unfit(why: str) -> Diagnostic:
    """Diagnostic of a recorded past that does not belong to the mission."""
    return Diagnostic(
        PAST_DOES_NOT_FIT,
        f"the recorded trajectory does not belong to this mission: {why}",
        None,
        help="use the plan folder and the recorded trajectory of the same flight",
    )


def not_said(error: NotProgressableError) -> Diagnostic:
    """Diagnostic of a requirement whose rest cannot be expressed as a formula."""
    span = getattr(error.node, "span", None)
    return Diagnostic(
        NOT_SAID,
        "no formula for the rest of this requirement: it needs a route at a past step, along agents with "
        "open conditions",
        None if span is None else Label(span),
        help="split this requirement into separate requirements",
    )
