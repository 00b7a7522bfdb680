"""Parallel attempts of a run in child processes, with the same outcome as in sequence.

A child has the run's state at its start, makes one attempt at a time and answers with the state of a run with only that
attempt. Answers are merged by attempt index; the first plan, by index, ends all attempts.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator
from dataclasses import replace
from functools import partial
from typing import Protocol, TypeAlias

from missionc.backends.api import Attempt, Budget, Snapshot, discard_snapshot, ignore
from missionc.backends.clot.run.child_processes import Say, children
from missionc.backends.clot.run.run_state import Nearest, Reached, RunCandidate, State, from_snapshot, to_snapshot
from missionc.backends.options import Options
from missionc.backends.run_account import Account
from missionc.base.late_dataclass import Record
from missionc.base.signals import defer_stop, stop_requested
from missionc.ir import Mission
from missionc.ir.kernel.nodes import Kernel

MakeAttempt: TypeAlias = Callable[[int], Reached | None]


class WorkerRun(Protocol):
    """Interface of a run (``backend.TransportRun``) for this module."""

    mission: Mission
    graph: Kernel
    options: Options
    budget: Budget
    account: Account
    late: bool
    best: RunCandidate | None
    beside: dict[str, str]
    spare: tuple[int, Reached] | None

    def in_time(self) -> bool: ...

    def keep(self, number: int) -> None: ...

    def consider(self, nearest: Nearest, come_to: Attempt) -> None: ...


class AttemptResult(Record, eq=False):
    """Result of an attempt from its child process.

    Args:
        state: state of a run with only this attempt.
        come_to: evaluation of its best candidate, if that is not a plan.
        late: True if a stage ended because the time limit was reached.
    """

    state: Snapshot
    come_to: Attempt | None
    account: Account
    late: bool


def run_parallel_attempts(
    run: WorkerRun, numbers: range, attempt: MakeAttempt
) -> Generator[float, float, tuple[int, Reached | None]]:
    """Index of the first attempt with a plan, and the plan; without a plan, the index of the attempt to continue with,
    and None.

    The generator pauses after each attempt, like a sequential run; the children continue.

    Args:
        numbers: indices of independent attempts.

    Raises:
        MemoryError: a child had too little memory.
    """
    made: dict[int, tuple[AttemptResult, State]] = {}
    number, last = numbers.start, numbers[-1]

    def drawn() -> Iterator[int]:
        for each in numbers:
            if each > last or not run.in_time():
                return
            yield each

    with children(
        min(run.options.processes, len(numbers)), partial(_make, run, attempt), run.budget.on_progress
    ) as workers:
        for place, answer in workers.answers(drawn(), stop_requested):
            state = from_snapshot(answer.state, run.mission, run.graph)
            made[numbers[place]] = answer, state
            if state.reached is not None and numbers[place] <= last:
                defer_stop()
                last = numbers[place]
                run.spare = last, state.reached
            while number in made:
                reached, as_before = _take_in(run, *made.pop(number))
                if reached is not None:
                    return number, reached
                number += 1
                yield run.account.work
                if not as_before:
                    return number, None
                if number <= numbers[-1]:
                    run.keep(number)
    return number, None


def _make(run: WorkerRun, attempt: MakeAttempt, number: int, say: Say) -> AttemptResult:
    """Result of an attempt, made in a child process."""
    run.best, run.late, run.account = None, False, Account()
    run.budget = replace(
        run.budget, on_progress=ignore if run.budget.on_progress is ignore else say, on_snapshot=discard_snapshot
    )
    run.account.sizes["attempts"] = number + 1
    reached = attempt(number)
    best = run.best
    state = State(number, best and best.nearest, beside=run.beside, reached=reached)
    return AttemptResult(to_snapshot(state, run.graph), best and best.attempt, run.account, run.late)


def _take_in(run: WorkerRun, made: AttemptResult, state: State) -> tuple[Reached | None, bool]:
    """Merge an attempt's result into the run.

    Returns:
        the plan of the attempt, if any; and True if the result does not change what later attempts start with.
    """
    run.late = run.late or made.late
    run.account.add(made.account)
    if state.nearest is not None and made.come_to is not None:
        run.consider(state.nearest, made.come_to)
    as_before = run.beside == state.beside
    run.beside.update(state.beside)
    return state.reached, as_before
