"""Plan requests: one value from the command line and from Python down to the backend."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

from missionc.backends.api import Backend, Budget
from missionc.backends.options import Options
from missionc.base.continuous_time import ContinuousTime
from missionc.base.units import Seconds
from missionc.compiler.checkpoints import Checkpoints
from missionc.compiler.incumbent import discard
from missionc.compiler.results import Compiled
from missionc.compiler.stage_log import StageLog
from missionc.ir.kernel.nodes import Kernel

NO_EXPLANATION = Seconds(0.0)


@dataclass(frozen=True, slots=True, eq=False)
class PlanRequest:
    """Request for a plan of a checked mission.

    Args:
        budget: seconds, bytes, work and seed, and the listeners of the run.
        checkpoints: of the run, and of the one that it takes up again.
        exports: names of forms that the flight is written in as well; one that cannot hold it is among the findings.
        continuous_time: whether requirements are wanted, or have, to hold between the steps too.
        explain_limit: seconds for ``Compiled.explained``; 0 leaves that out.
        alternatives: number of plans that differ from each other; there may be fewer.
        secure: receives each verified plan as soon as it exists, each one better than the one before. The last of them
            is the answer, whatever becomes of the steps that follow it.
        kernel: in place of the mission's own, a stronger one.
        backend: in place of the chosen engines.
        speed_fraction: of the vehicles' top speeds; below 1, no faster plan is searched for.
        log: receives each attempt when it ends.

    Raises:
        ValueError: ``alternatives`` and ``options.stretch`` exclude each other.
    """

    budget: Budget
    options: Options = field(default_factory=Options)
    checkpoints: Checkpoints = field(default_factory=Checkpoints)
    exports: tuple[str, ...] = ()
    continuous_time: ContinuousTime = ContinuousTime.WANTED
    explain_limit: Seconds = NO_EXPLANATION
    alternatives: int = 1
    secure: Callable[[Compiled], object] = discard
    kernel: Kernel | None = None
    backend: Backend | None = None
    speed_fraction: float = 1.0
    log: StageLog = field(default_factory=StageLog)

    def __post_init__(self) -> None:
        if self.alternatives > 1 and self.options.stretch != 1:
            raise ValueError("alternatives are planned at the mission's own pace, and cannot be stretched")

    @property
    def further(self) -> PlanRequest:
        """The request for one more plan: without checkpoints, explanation and receiver."""
        return replace(self, checkpoints=Checkpoints(), explain_limit=NO_EXPLANATION, secure=discard)
