"""A backend asked for a restricted mission, with a share of the work and nothing kept of the run.

in   a backend, Mission, Kernel, Restriction, work
out  its Outcome, or Ended where time was up
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial

from missionc.backends.api import Backend, Budget, Outcome, forget, unheard
from missionc.backends.options import Options
from missionc.ir import Mission
from missionc.kernel.nodes import Kernel
from missionc.pipeline.alternatives.restriction import Restriction
from missionc.pipeline.plan_with_margin import plan_with_margin
from missionc.pipeline.run_limited import Ended, within


def plan_restricted(
    backend: Backend,
    mission: Mission,
    kernel: Kernel,
    restriction: Restriction,
    options: Options,
    budget: Budget,
    work: float,
    moment: float,
) -> Outcome | Ended:
    """What a backend makes of a mission with a restriction.

    Args:
        work: units of it that the backend may spend.
        moment: when it is interrupted, on the clock of ``time.monotonic``.
    """
    short = replace(budget, work=work, keep=forget, resume=None, found=unheard)
    narrower = restriction.applied(mission, kernel)
    return within(moment, partial(plan_with_margin, backend, *narrower, options, short))
