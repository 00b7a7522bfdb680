"""The runs of a sweep: given to an executor, and written into the journal one by one as they come back.

    in   the grid, the settings, the rows that are there, a Pool, the Journal
    out  Swept: all rows, and what ended it early
    says MC702 MC764 MC765, and what writing a plan deserves

Each run is a function of its text, so that neither the number of workers nor
the order in which they answer changes a row, but for how long it took.
"""

from __future__ import annotations

import queue
import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import CancelledError, Future
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

from missionc.diagnostics.code import OTHER_VERSIONS
from missionc.diagnostics.model import Diagnostic
from missionc.output.folder.unwritable import cannot_write, reason
from missionc.output.folder.write_file import linked
from missionc.output.folder.write_folder import write_folder
from missionc.sweep import executors, run_answer, run_request
from missionc.sweep.append_journal import Journal
from missionc.sweep.executors import Pool
from missionc.sweep.run_answer import ERROR, Answer, RunResult
from missionc.sweep.run_grid import Combination, Run
from missionc.sweep.run_request import Request, Settings
from missionc.sweep.sweep_folder import JOURNAL, PLANS, Row

AHEAD = 4
"""Runs for each worker that are given to the executor before the first of them is over."""
EVERY = 0.2
"""Seconds after which somebody looks whether to go on."""
SYNCED = 1.0
"""Seconds after which what was written is on the disk."""


@dataclass(slots=True)
class Swept:
    """What was done; ``finding`` is what ended it before all was."""

    rows: dict[Run, Row]
    finding: Diagnostic | None = None
    interrupted: bool = False
    seconds: list[float] = field(default_factory=list)


def run_sweep(
    left: Iterator[Run],
    settings: Settings,
    engines: Mapping[Combination, tuple[str, ...]],
    rows: dict[Run, Row],
    pool: Pool,
    journal: Journal,
    folder: Path,
    stop: Callable[[], bool],
    listen: Callable[[Row, int], None],
) -> Swept:
    """Do the runs that are left.

    Args:
        left: the runs to do, in their order.
        rows: those that are over; more are added.
        stop: asked again and again whether to leave it there.
        listen: told of every run that is over, and how many workers there are.
    """
    answers: queue.SimpleQueue[tuple[Run, Future[str]]] = queue.SimpleQueue()
    swept = Swept(rows)
    under_way: set[Future[str]] = set()
    again: Counter[Run] = Counter()

    def give(run: Run) -> None:
        text = run_request.written(Request(settings, dict(run.values), run.seed, engines.get(run.values, ())))
        future = pool.submit(text)
        under_way.add(future)
        future.add_done_callback(lambda done: answers.put((run, done)))

    workers, looked, synced = pool.workers(), time.monotonic(), time.monotonic()
    more = True
    while True:
        while more and len(under_way) < AHEAD * max(1, workers):
            run = next(left, None)
            if run is None:
                more = False
                break
            give(run)
        if not under_way or stop() or swept.finding:
            swept.interrupted = bool(under_way) or more
            break
        now = time.monotonic()
        if now - looked > EVERY:
            workers, looked = pool.workers(), now
        with suppress(queue.Empty):
            run, done = answers.get(timeout=EVERY)
            under_way.discard(done)
            if executors.abandoned(done) and again[run] < executors.AGAIN:
                again[run] += 1
                give(run)
                continue
            row = _row(run, done, settings)
            wrong = row if isinstance(row, Diagnostic) else _written(row, journal, folder, settings.keep)
            if isinstance(row, Row) and not wrong:
                rows[run] = Row(run, RunResult(row.result.outcome, row.result.values, row.result.sizes), row.host)
                listen(rows[run], workers)
            swept.finding = wrong
        if now - synced > SYNCED:
            journal.sync()
            synced = now
    for future in under_way:
        future.cancel()
    with suppress(OSError):
        journal.sync()
    return swept


def _row(run: Run, done: Future[str], settings: Settings) -> Row | Diagnostic:
    """What came back: a row, or why nothing more will."""
    answer = received(done, settings.versions)
    return answer if isinstance(answer, Diagnostic) else Row(run, answer.result, answer.host)


def received(done: Future[str], asked: Mapping[str, str]) -> Answer | Diagnostic:
    """What a worker answered, an error among others; or why no worker will answer.

    Args:
        asked: the versions that were asked for.
    """
    try:
        answer = run_answer.read(done.result())
    except CancelledError:
        return executors.lost("it no longer knows of the runs it was given")
    except (ValueError, KeyError, TypeError) as error:
        return Answer(RunResult(ERROR, {"says": f"the answer cannot be read: {error}"}))
    except ImportError as error:
        return _other_versions("a worker", f"it has no such module: {error}")
    except Exception as error:
        if executors.abandoned(done):
            return Answer(RunResult(ERROR, {"says": "every worker that this run was given to died"}))
        return executors.lost(f"{type(error).__name__}: {error}")
    if not answer.versions:
        return answer
    names = sorted(name for name in {*answer.versions, *asked} if answer.versions.get(name) != asked.get(name))
    told = (f"{name} {answer.versions.get(name, 'missing')}, here {asked.get(name, 'missing')}" for name in names)
    return _other_versions(f"a worker on `{answer.host}`", "; ".join(told))


def _written(row: Row, journal: Journal, folder: Path, keep: bool) -> Diagnostic | None:
    """The plan first, then the line that says that it is there."""
    try:
        if keep and row.result.files:
            wrong = linked(folder, PLANS) or write_folder(folder / PLANS / row.run.name, row.result.files, True)
            if wrong:
                return wrong
        journal.add(row.as_line())
    except OSError as error:
        return cannot_write(folder / JOURNAL, reason(error))
    return None


def _other_versions(who: str, why: str) -> Diagnostic:
    help_ = "install the same versions on every machine: `pip install -c constraints.txt missionc`"
    return Diagnostic(OTHER_VERSIONS, f"{who} has other versions than this machine", None, notes=(why,), help=help_)
