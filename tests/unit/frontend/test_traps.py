"""The traps of `missionc explain`: on each run, the two readings differ as the page says."""

from __future__ import annotations

import numpy as np
import pytest

from missionc import ir
from missionc.base.limits import Limits
from missionc.base.trace import Trace
from missionc.base.units import Seconds
from missionc.frontend.explain.convention_examples import TRAPS, Example, Trap
from missionc.frontend.explain.explanation import linked, table, traps_of
from missionc.ir.kernel.nodes import At, Is, Neighbour
from missionc.ir.lower.expand import expand
from missionc.verification.monitoring.monitor import monitor, truth
from tests.support.random_runs import SPAN
from tests.support.resolved_missions import mission


def small_mission(example: Example) -> str:
    """The mission that a run is of, with the formula asked and its other reading as requirements."""
    steps = max(len(example.places[0]) - 1, 1)
    starts = ", ".join(f"({x:g}, {y:g})" for (x, y), *_ in example.places)
    return f"""mission example
time step 1 s, horizon {steps} s
world (0, 0) to (4, 4)
team a[{len(example.places)}] {{ radius 0.1 m  dynamics single_integrator(speed <= 4 m/s)  start at {starts} }}
{example.declarations.strip()}
require asked: {example.asked}
require otherwise: {example.otherwise}
"""


def run_of(trap: Trap, text: str) -> tuple[ir.Mission, Trace]:
    made = mission(text)
    paths = [path if len(path) > 1 else path * 2 for path in trap.example.places]
    position = np.array(paths, dtype=np.float64)
    return made, Trace(Seconds(1.0), position, np.zeros_like(position), np.zeros(position.shape[:2]))


def test_the_two_readings_differ_on_the_run(subtests: pytest.Subtests) -> None:
    for trap in TRAPS:
        with subtests.test(trap.name):
            made, trace = run_of(trap, small_mission(trap.example))
            kernel, found = expand(made, Limits())
            assert kernel is not None
            assert not found
            said = {judged.name: judged.satisfied for judged in monitor(made, kernel, trace).requirements}
            assert said == {"asked": trap.example.holds, "otherwise": not trap.example.holds}


def test_the_table_shows_the_run(subtests: pytest.Subtests) -> None:
    for trap in TRAPS:
        with subtests.test(trap.name):
            example = trap.example
            for formula, cells in example.rows:
                text = small_mission(example) + f"require row: a[0]: ({formula})\n"
                made, trace = run_of(trap, text)
                kernel, _ = expand(made, Limits())
                assert kernel is not None
                asked = kernel.requirements[-1].formula
                assert isinstance(asked, At)
                values = truth(asked.body, made, trace)
                seen = values[:, 0] if example.agents else values[0]
                assert [cell == "T" for cell in cells] == list(seen[: len(cells)])
                assert len(cells) == (len(example.places) if example.agents else len(example.places[0]))


@pytest.mark.parametrize("trap", [trap for trap in TRAPS if trap.example.agents], ids=lambda trap: trap.name)
def test_the_links_shown_are_those_of_the_graph(trap: Trap) -> None:
    made, trace = run_of(trap, small_mission(trap.example))
    graph, team = made.graphs[0], range(len(made.agents))
    pairs = [
        f"a[{one}]-a[{other}]"
        for one in team
        for other in team
        if one < other and truth(Neighbour(graph, Is(frozenset((other,)), SPAN), SPAN), made, trace)[one, 0]
    ]
    assert linked(trap.example) == pairs


def test_a_trap_is_found_in_its_own_example(subtests: pytest.Subtests) -> None:
    for trap in TRAPS:
        with subtests.test(trap.name):
            made = mission(small_mission(trap.example))
            assert trap in traps_of(made.requirements[0].formula)


def test_a_table_fits_the_page(subtests: pytest.Subtests) -> None:
    for trap in TRAPS:
        with subtests.test(trap.name):
            assert max(map(len, table(trap.example))) <= 96
