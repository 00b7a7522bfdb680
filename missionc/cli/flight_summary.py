"""Summaries of simulated flights: lines of text, and a JSON document."""

from __future__ import annotations

from typing import TYPE_CHECKING

from missionc.base.trace import counted, decimals
from missionc.base.units import Seconds
from missionc.cli.summary import in_brackets

if TYPE_CHECKING:
    from missionc.base.trace import Judgement
    from missionc.tools.replay.simulate_folder import Simulated
    from missionc.verification.certificate import Check


ROWS = {"nothing touched": "no collisions", "tracking": "tracking error", "all of them": "all requirements"}
"""Titles of the rows of a summary, by their names in documents."""


def simulated_lines(simulated: Simulated) -> list[str]:
    """Lines with the verdict, requirements, tracking error and clearances of simulated flights.

    For several flights these are fractions and worst values.
    """
    from missionc.flight.simulation.trials import headline

    trials, opened = simulated.trials, simulated.opened
    if trials is None or opened is None:
        return []
    mission, trial, planned = opened.mission, trials.trial, simulated.planned
    lines = [
        f"{mission.name}: {headline(trials)}",
        f"  {counted(len(mission.agents), 'agent')} for {mission.horizon:g} s, "
        f"engine {trial.engine}, seed {trial.seed}",
    ]
    if opened.differing:
        lines.append(f"  warning: {counted(len(opened.differing), 'file')} changed after compilation")
    first = trials.flights[0]
    if (trial.flights == 1 or not trial.disturbance.random) and planned is not None:
        before = (*planned.requirements, *planned.preferences)
        lines += _compared(before, (*first.requirements, *first.preferences), mission.step)
    else:
        fractions = {ROWS.get(name, name): each for name, each in trials.fractions().items()}
        width = max(map(len, fractions))
        lines += [
            f"  {name:<{width}}  {each.held} of {each.flights}  {each.share:.3f}, two-sided 95 % confidence interval "
            f"{each.low:.3f} to {each.high:.3f}"
            for name, each in fractions.items()
        ]
    lines.append("tracking error: mean, 95th percentile, maximum" + (" of all flights" if trial.flights > 1 else ""))
    width = max(len(agent.name) for agent in mission.agents)
    for agent, most in zip(mission.agents, trials.allowed.tolist(), strict=True):
        error = trials.error(agent.index)
        excess = "" if error.most <= most else f", above the limit of {most:g} m"
        figures = f"{error.mean:.3f} m  {error.usual:.3f} m  {error.most:.3f} m at {error.at:.2f} s"
        lines.append(f"  {agent.name:<{width}}  {figures}{excess}")
    named = [("between agents" if check.name == "separation" else check.subject, check) for check in trials.room()]
    width = max((len(name) for name, _ in named), default=0)
    lines += ["smallest distance between bodies"] if named else []
    return [*lines, *(f"  {name:<{width}}  {_room(check)}" for name, check in named)]


def _room(check: Check) -> str:
    return f"{decimals(check.margin)} m at {check.at or 0.0:.2f} s{in_brackets(check.agents)}"


def _compared(planned: tuple[Judgement, ...], flown: tuple[Judgement, ...], step: Seconds) -> list[str]:
    width = max((len(each.name) for each in flown), default=0)
    return [
        f"  {after.name:<{width}}  planned {decimals(before.robustness)}, flown {after.verdict(step)}"
        for before, after in zip(planned, flown, strict=True)
    ]


def simulated_document(simulated: Simulated) -> dict[str, object]:
    """JSON document of simulated flights; ``passed`` is null if there were none."""
    if simulated.trials is None or simulated.opened is None or simulated.planned is None:
        return {"passed": None}
    from missionc.output.documents.simulation_json import simulation_record

    return simulation_record(simulated.opened.mission, simulated.planned.requirements, simulated.trials)
