"""Runner of a method on its seeds in a separate process, with limits of CPU time and memory.

A timer of CPU time ends the process, so that other load on the machine favours no method; another process then
continues with the next seed. A method that loads a library on its first call may first solve a small mission, whose
time does not count.
"""

from __future__ import annotations

import importlib
import multiprocessing
import resource
import signal
import time
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path

import missionc

GRACE = 20.0
"""Wall-clock seconds for each CPU second before a process counts as hung."""


@dataclass(frozen=True)
class Task:
    """Task; ``module``: in this package; ``warm``: an uncounted first call.

    ``options``: arguments of ``plan``.
    """

    module: str
    file: Path
    agents: int
    limit: float
    memory: int
    warm: bool = False
    options: tuple[tuple[str, object], ...] = ()


@dataclass(frozen=True)
class Run:
    """One seed: CPU seconds, peak memory of the process so far in bytes, and the score or the reason for none.

    ``iterations`` and ``joint_motions`` are those of a search, where it tells them.
    """

    seed: int
    seconds: float
    memory: int
    score: object
    words: str = ""
    iterations: int | None = None
    joint_motions: int | None = None


def runs(task: Task, seeds: list[int]) -> list[Run]:
    """Outcome of every seed, in order."""
    context = multiprocessing.get_context("spawn")
    done: list[Run] = []
    while len(done) < len(seeds):
        near, far = context.Pipe(duplex=False)
        child = context.Process(target=_child, args=(task, seeds[len(done) :], far), daemon=True)
        child.start()
        far.close()
        peak = 0
        try:
            while len(done) < len(seeds):
                hung = time.monotonic() + GRACE * task.limit + 120
                while not near.poll(0.5):
                    peak = _peak(child.pid) or peak
                    if time.monotonic() > hung:
                        raise EOFError
                done.append(near.recv())
        except EOFError:
            child.join(5)
            child.kill()
            child.join()
            ended = child.exitcode == -signal.SIGPROF
            words = f"stopped after {task.limit:g} s" if ended else f"ended with {child.exitcode}"
            done.append(Run(seeds[len(done)], task.limit if ended else float("nan"), peak, None, words))
        near.close()
        child.join()
    return done


def _peak(process: int | None) -> int:
    """Peak resident memory of a process, bytes; 0 if the system does not provide it."""
    try:
        status = Path(f"/proc/{process}/status").read_text()
    except OSError:
        return 0
    lines = [line.split() for line in status.splitlines() if line.startswith("VmHWM")]
    return int(lines[0][1]) * 1024 if lines else 0


def _child(task: Task, seeds: list[int], pipe: Connection) -> None:
    from table1.scene import Unsupported
    from table1.score import Searched, score

    resource.setrlimit(resource.RLIMIT_DATA, (task.memory, task.memory))
    plan = importlib.import_module(f"table1.{task.module}").plan
    options = dict(task.options)

    def checked(agents: int) -> tuple[object, object]:
        found = missionc.check(task.file, overrides={"N": str(agents)}, backend="clot")
        assert found.mission is not None
        assert found.kernel is not None
        return found.mission, found.kernel

    if task.warm:
        plan(*checked(2), 0, task.limit, **options)
    mission, kernel = checked(task.agents)
    for seed in seeds:
        signal.setitimer(signal.ITIMER_PROF, task.limit)
        begin = time.process_time()
        try:
            made: object = plan(mission, kernel, seed, task.limit, **options)
        except Unsupported as what:
            made = f"no formulation: {what}"
        except MemoryError:
            made = "out of memory"
        seconds = time.process_time() - begin
        signal.setitimer(signal.ITIMER_PROF, 0)
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
        counts: tuple[int | None, int | None] = (None, None)
        if isinstance(made, Searched):
            made, counts = made.trace, (made.iterations, made.joint_motions)
        words = made if isinstance(made, str) else ""
        scored = None if isinstance(made, str) else score(mission, kernel, made)
        pipe.send(Run(seed, seconds, peak, scored, words, *counts))
