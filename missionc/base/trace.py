"""Traces: joint trajectories as arrays, shared by backends, files, the monitor and the emitters."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import field
from typing import TYPE_CHECKING, TypeAlias

from missionc.base.judgement import Judgement, judgement_lines
from missionc.base.late_dataclass import Record
from missionc.base.notebook import Ground, paths, picture, preformatted, printed
from missionc.base.proven import Proven
from missionc.base.solved import Solved, solved_text
from missionc.base.stage_runs import StageRun
from missionc.base.units import Seconds

if TYPE_CHECKING:  # a trace only contains arrays: the code that makes them loads numpy
    import numpy as np
    from numpy.typing import NDArray

Array: TypeAlias = "NDArray[np.float64]"
Flags: TypeAlias = "NDArray[np.bool_]"
Indices: TypeAlias = "NDArray[np.int64]"


class Trace(Record, eq=False):
    """Joint trajectory: the state of every agent at every step 0 … last, agents in mission order.

    Args:
        step: time between two states, seconds.
        position: agent centres, (agents, steps + 1, dim), metres.
        velocity: (agents, steps + 1, dim), m/s. For first-order dynamics, the constant velocity during the step that
            begins at the state (at the last state, of the step that ended there); for second-order dynamics, the
            velocity at the state.
        heading: (agents, steps + 1), rad; orientation at the beginning of the step that begins at the state.
        derived: names of ``velocity`` and ``heading`` if they were computed from recorded positions.

    Between two steps a first-order agent moves on a straight line at constant velocity; a second-order agent
    (``ir.dynamics``) has constant acceleration.
    """

    step: Seconds
    position: Array
    velocity: Array
    heading: Array
    derived: tuple[str, ...] = field(default=(), kw_only=True)

    def part(self, agents: Sequence[int], first: int, last: int) -> Trace:
        """Trace of some agents, by row, from the step ``first`` to the step ``last``, both included."""
        rows, steps = list(agents), slice(first, last + 1)
        return Trace(self.step, self.position[rows, steps], self.velocity[rows, steps], self.heading[rows, steps])

    @property
    def metres(self) -> float:
        """Total path length of all agents, metres, with straight lines between steps."""
        moves = self.position[:, 1:] - self.position[:, :-1]
        return float(((moves**2).sum(axis=-1) ** 0.5).sum())

    @property
    def effort(self) -> float:
        """Control effort: integral of the squared accelerations of all agents over time, m²/s³. [clot] (2)."""
        changes = self.velocity[:, 1:] - self.velocity[:, :-1]
        return float((changes**2).sum() / self.step)

    @property
    def lasts(self) -> int:
        """Number of steps after which all agents are at rest until the end of the trace."""
        moved = (self.position[:, 1:] != self.position[:, :-1]) | (self.velocity[:, :-1] != 0)
        steps = moved.any(axis=(0, 2)).nonzero()[0]
        return int(steps[-1]) + 1 if steps.size else 0


class Plan(Record, eq=False):
    """Verified joint plan, ready to be written; a notebook displays its paths and its verdicts."""

    mission: str
    backend: str
    seed: int
    trace: Trace
    judgements: tuple[Judgement, ...]
    proven: Proven | None = None
    """Lower bound of the objective, if the mission minimizes a quantity for which a bound is proved."""
    solved: tuple[Solved, ...] = ()
    """Planning method of each agent's trajectory; empty if unknown."""
    runs: tuple[StageRun, ...] = ()
    """Attempts of the compilation that led to the plan, in order; empty if unknown."""
    ground: Callable[[], Ground] | None = None
    """Function that computes the background of the paths for a notebook."""

    @property
    def times(self) -> Array:
        """Times of the steps, (steps + 1,), seconds."""
        import numpy as np

        return np.arange(self.trace.position.shape[1], dtype=np.float64) * self.trace.step

    @property
    def robustness(self) -> dict[str, float]:
        """Robustness of each requirement, by requirement name."""
        return {each.name: each.robustness for each in self.judgements}

    def __str__(self) -> str:
        agents, states, _ = self.trace.position.shape
        head = (
            f"{self.mission}: planned by {self.backend}, {agents} agent{'s' if agents > 1 else ''}, "
            f"{states - 1} step{'s' if states != 2 else ''} of {self.trace.step:g} s, seed {self.seed}"
        )
        known = filter(None, (solved_text(self.solved), str(self.proven) if self.proven else ""))
        return "\n".join([head, *judgement_lines(self.judgements, self.trace.step), *known])

    _repr_pretty_ = printed

    def _repr_html_(self) -> str:
        return picture(paths(self.trace.position.tolist(), self.ground() if self.ground else None)) + preformatted(
            str(self)
        )
