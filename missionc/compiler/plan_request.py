"""Plan requests: one value that the command line or Python passes down to the backend."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import field, replace

from missionc.backends.api import Backend, Budget
from missionc.backends.options import Options
from missionc.base.continuous_time import ContinuousTime
from missionc.base.late_dataclass import Record
from missionc.base.units import Seconds
from missionc.compiler.checkpoints import Checkpoints
from missionc.compiler.incumbent import discard
from missionc.compiler.results import Compiled
from missionc.compiler.stage_log import StageLog
from missionc.ir.kernel.nodes import Kernel

NO_EXPLANATION = Seconds(0.0)


class PlanRequest(Record, eq=False):
    """Request for a plan of a checked mission.

    Args:
        budget: time, memory, work and seed, and the listeners of the run.
        checkpoints: checkpoint of the run, and of the resumed one.
        exports: names of additional flight formats; unsuitable ones are reported.
        continuous_time: whether continuous-time satisfaction is wanted or required.
        explain_limit: seconds for ``Compiled.explained``; 0 for none.
        alternatives: number of different plans; there may be fewer.
        secure: receives each verified plan as soon as it exists, each better than the previous one. The last one is the
            answer, for any result of later stages.
        kernel: stronger kernel to use instead of the mission's own.
        backend: backend to use instead of the chosen engines.
        speed_fraction: fraction of the vehicles' top speeds; below 1, an upper limit for plans.
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
            raise ValueError("alternatives have the duration of the mission, and cannot be scaled in time")

    @property
    def further(self) -> PlanRequest:
        """The request for another plan, without checkpoints, explanation and ``secure``."""
        return replace(self, checkpoints=Checkpoints(), explain_limit=NO_EXPLANATION, secure=discard)
