"""The step of a violation against its definition: the first by which no continuation mends it, tried one by one."""

from __future__ import annotations

from functools import cache
from itertools import product

import numpy as np
from hypothesis import example, given, settings
from hypothesis import strategies as st

from missionc import ir
from missionc.base.units import Steps
from missionc.ir.language.operators import by_name
from missionc.ir.lower.expand import expand
from missionc.verification.monitoring.live.first_violations import first_violations
from missionc.verification.monitoring.monitor import monitor
from tests import reference
from tests.support.random_runs import SPAN, Case, cases, mission_of, positions, run_of, trace_of

CORNERS = tuple(product((2.0, 0.0), (0.0, 2.0)))
"""Where an agent may be: both of the comparisons below hold at the first, each at two of them."""

EAST = ir.Holds(ir.Compare(((1.0, ir.Coordinate(0)),), -1.0, False), SPAN)
SOUTH = ir.Holds(ir.Compare(((-1.0, ir.Coordinate(1)),), 1.0, False), SPAN)


@cache
def growing(budget: int, depth: int) -> st.SearchStrategy[ir.Formula]:
    """Formulas that look at most so many steps ahead, and negate nothing: what is true more often keeps them true.

    So the best continuation of each is to be in the south-east, and no two parts of one ask for opposites.
    """
    plain: st.SearchStrategy[ir.Formula] = st.sampled_from([EAST, SOUTH])
    if depth == 0:
        return plain
    joined = st.builds(
        lambda name, left, right: ir.Apply(by_name[name], (left, right), None, SPAN),
        st.sampled_from(["and", "or"]),
        growing(budget, depth - 1),
        growing(budget, depth - 1),
    )
    windows = st.integers(0, budget).flatmap(lambda high: st.tuples(st.integers(0, high), st.just(high)))

    def over(names: list[str], arity: int, back: bool) -> st.SearchStrategy[ir.Formula]:
        def made(name: str, window: tuple[int, int]) -> st.SearchStrategy[ir.Formula]:
            below = growing(budget if back else budget - window[1], depth - 1)
            bounds = ir.Window(Steps(window[0]), Steps(window[1]), SPAN)
            return st.tuples(*[below] * arity).map(lambda parts: ir.Apply(by_name[name], parts, bounds, SPAN))

        return st.tuples(st.sampled_from(names), windows).flatmap(lambda drawn: made(*drawn))

    return st.one_of(
        joined,
        over(["always", "eventually"], 1, False),
        over(["until", "release"], 2, False),
        over(["once", "historically"], 1, True),
        over(["since"], 2, True),
        plain,
    )


def _over(name: str, low: int, high: int, *parts: ir.Formula) -> ir.Formula:
    return ir.Apply(by_name[name], parts, ir.Window(Steps(low), Steps(high), SPAN), SPAN)


BEST = CORNERS[0]


# Lost at 1 s, and not where the window that looks back is broken once more; lost when the end cannot come any more.
@example(_over("eventually", 3, 3, _over("historically", 0, 2, EAST)), [BEST, (0.0, 0.0), BEST, (0.0, 0.0)])
@example(_over("until", 0, 2, EAST, _over("eventually", 0, 1, SOUTH)), [(0.0, 2.0), (0.0, 2.0), BEST, BEST])
@given(growing(3, 3), st.lists(st.sampled_from(CORNERS), min_size=4, max_size=4))
def test_nothing_later_mends_a_violation_from_its_first_step_on(
    formula: ir.Formula, places: list[tuple[float, float]]
) -> None:
    last = len(places) - 1
    own = ir.AtLeastOf("every", 1, ir.AgentSet("drone", (0,), SPAN), formula, SPAN)
    mission = mission_of(1, last, ir.Requirement("asked", own, SPAN))
    kernel, _ = expand(mission)
    assert kernel is not None
    (judgement,) = monitor(mission, kernel, trace_of([places])).requirements

    def is_mended(known: int) -> bool:
        """Whether some continuation of the first places satisfies it."""
        return any(
            reference.truth(own, run_of(mission, trace_of([[*places[:known], *later]])), 0, 0)
            for later in product(CORNERS, repeat=last + 1 - known)
        )

    first = next((known - 1 for known in range(1, last + 2) if not is_mended(known)), None)
    assert judgement.step == first


@settings(max_examples=50)
@given(cases(), st.data())
def test_no_other_continuation_mends_a_violation(case: Case, data: st.DataObject) -> None:
    """With every operator and predicate, where the best continuation is not known."""
    size, last = len(case.trace.position), case.run.last
    every = ir.AtLeastOf("every", size, ir.AgentSet("drone", tuple(range(size)), SPAN), case.formula, SPAN)
    mission = mission_of(size, last, ir.Requirement("asked", every, SPAN))
    kernel, _ = expand(mission)
    assert kernel is not None
    (judgement,) = monitor(mission, kernel, case.trace).requirements
    if judgement.step is not None and judgement.step < last:
        other = case.trace.position.copy()
        other[:, judgement.step + 1 :] = np.array(data.draw(positions(size, last)))[:, judgement.step + 1 :]
        trace = trace_of(other.tolist())
        trace.velocity[:, : judgement.step + 1] = case.trace.velocity[:, : judgement.step + 1]
        assert not reference.truth(every, run_of(mission, trace), 0, 0)


@settings(max_examples=50)
@given(cases())
def test_online_monitoring_is_certain_of_a_violation_no_later_than_where_it_begins(case: Case) -> None:
    size = len(case.trace.position)
    every = ir.AtLeastOf("every", size, ir.AgentSet("drone", tuple(range(size)), SPAN), case.formula, SPAN)
    mission = mission_of(size, case.run.last, ir.Requirement("asked", every, SPAN))
    kernel, _ = expand(mission)
    assert kernel is not None
    (judgement,) = monitor(mission, kernel, case.trace).requirements
    found = first_violations(mission, kernel, case.trace)
    if judgement.step is None:
        assert not found
    else:
        assert found["asked"] <= judgement.step
