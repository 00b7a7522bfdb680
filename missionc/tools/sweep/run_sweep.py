"""The runs of a sweep: executors, worker processes, and the journal of returned rows.

    in   the grid, the settings, the existing rows, a Pool, the Journal
    out  Swept: all rows, and the reason for an early end
    says MC404 MC702 MC764 MC765, and the codes of writing a plan

Each run is a function of its text, so neither the number of workers nor the order of their answers changes a row,
except its run time.

An executor is a ``concurrent.futures.Executor``: processes of this machine, or a Dask cluster. It takes a text and
returns a text, so nothing else is transferred. Dask's scheduler assigns runs to free workers, and reassigns those of a
worker that dies. A worker thread has a process of its own (``run_server``), which stays for the next run. If it dies,
another process repeats the run, once.
"""

from __future__ import annotations

import logging
import os
import queue
import re
import signal
import subprocess
import sys
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import CancelledError, Executor, Future, ThreadPoolExecutor
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from missionc.base.diagnostics.code import CLUSTER_UNREACHABLE, EXTRA_MISSING, OTHER_VERSIONS
from missionc.base.diagnostics.model import Diagnostic
from missionc.output.folder.ownership import cannot_write, reason
from missionc.output.folder.write_folder import linked, write_folder
from missionc.tools.sweep import run_answer, run_request
from missionc.tools.sweep.append_journal import Journal
from missionc.tools.sweep.run_answer import ERROR, Answer, RunResult
from missionc.tools.sweep.run_grid import Combination, Run
from missionc.tools.sweep.run_request import Request, Settings
from missionc.tools.sweep.sweep_folder import JOURNAL, PLANS, Row

if TYPE_CHECKING:
    from distributed import Client


TRIES = 2
"""Maximum number of processes that start a run, if they die."""
PROCESS_PATIENCE = 5.0
"""Maximum seconds that a process takes to end after its last request."""
SERVER = "missionc.tools.sweep.run_server"
HOME = Path(__file__).resolve().parents[2]
"""Path of this package, which the started processes must import as well."""


class RunProcess:
    """Process that answers requests one by one; the first request starts it."""

    def __init__(self) -> None:
        self._room = TemporaryDirectory(prefix="missionc-sweep-", ignore_cleanup_errors=True)
        self._process = _started_process(self._room.name)

    def ask(self, request: str) -> str:
        """Send a request, and return the answer; empty if the process died before it."""
        process = self._process
        assert process.stdin is not None
        assert process.stdout is not None
        try:
            process.stdin.write(request.encode("ascii") + b"\n")
            process.stdin.flush()
            line = process.stdout.readline()
        except (OSError, ValueError):  # it has died, or was ended from another thread
            return ""
        return line.decode("ascii").removesuffix("\n") if line.endswith(b"\n") else ""

    def end(self) -> None:
        """End the process and its current run; can be called from any thread."""
        process = self._process
        process.terminate()
        try:
            process.wait(PROCESS_PATIENCE)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        for stream in (process.stdin, process.stdout):
            with suppress(OSError, ValueError):
                assert stream is not None
                stream.close()
        self._room.cleanup()


class RunProcesses:
    """Processes for threads, one each: a thread's first request starts its process, unless all have been ended."""

    def __init__(self) -> None:
        self._own = threading.local()
        self._all: set[RunProcess] = set()
        self._lock = threading.Lock()
        self._ended = False

    def answer_to(self, request: str) -> str:
        """Answer to a request (``run_request_text``), as a text for ``read_run_answer``."""
        for _ in range(TRIES):
            process = self._of_this_thread()
            if process is None:
                return run_answer.failed("the run was interrupted")
            answer = process.ask(request)
            if answer:
                return answer
            self._forget(process)
        return run_answer.failed(f"the process of the run ended unexpectedly {TRIES} times")

    def end(self) -> None:
        """End all processes with their current runs."""
        with self._lock:
            self._ended = True
            left, self._all = self._all, set()
        for process in left:
            process.end()

    def _of_this_thread(self) -> RunProcess | None:
        process: RunProcess | None = getattr(self._own, "process", None)
        with self._lock:
            if self._ended:
                return None
            if process is None:
                process = self._own.process = RunProcess()
                self._all.add(process)
        return process

    def _forget(self, process: RunProcess) -> None:
        self._own.process = None
        with self._lock:
            mine = process in self._all
            self._all.discard(process)
        if mine:
            process.end()


def _started_process(room: str) -> subprocess.Popen[bytes]:
    path = os.pathsep.join(filter(None, (str(HOME), os.environ.get("PYTHONPATH", ""))))
    return subprocess.Popen(  # noqa: S603 (our own interpreter, and our own module)
        [sys.executable, "-P", "-m", SERVER, room],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        env={**os.environ, "PYTHONPATH": path, "TMPDIR": room},
        start_new_session=True,  # the parent handles Ctrl-C
    )


_here = RunProcesses()


def answer_to(request: str) -> str:
    """Answer to a request by a module-level ``RunProcesses``, for workers that get only a function's name."""
    return _here.answer_to(request)


LOCAL = re.compile(r"local:(\d+)")
ADDRESS = re.compile(r"[a-z][a-z+]*://\S+")
MOST_WORKERS = 1024
"""Maximum number of worker processes on this machine."""
UNWATCHED = {"distributed.worker.profile.enabled": False, "distributed.admin.tick.interval": "500 ms"}
"""Dask settings of a cluster that is started here: waiting workers are not profiled."""
AGAIN = 4
"""Maximum number of times that a request is repeated after a cluster gave it up."""
CONNECTION_PATIENCE = 10.0
"""Maximum seconds until a scheduler is reached, and then until its first worker is ready."""


@dataclass(frozen=True, slots=True)
class Pool:
    """Workers: an executor, the function that it calls, and a function that returns its current number of workers."""

    executor: Executor
    answer_to: Callable[[str], str]
    workers: Callable[[], int]

    def submit(self, text: str) -> Future[str]:
        """Submit a request; return the future of its answer."""
        return self.executor.submit(self.answer_to, text)


def abandoned(done: Future[str]) -> bool:
    """Return whether Dask gave up a request because too many workers died with it.

    Most of them had not started it, so it is tried again.
    """
    return not done.cancelled() and type(done.exception()).__name__ == "KilledWorker"


def processors() -> int:
    """Number of processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def understood(cluster: str) -> bool:
    """Return whether a text names a cluster: ``local:8``, the address of a scheduler, or a file with it."""
    local = LOCAL.fullmatch(cluster)
    if local:
        return 1 <= int(local[1]) <= MOST_WORKERS
    return ADDRESS.fullmatch(cluster) is not None or Path(cluster).is_file()


@contextmanager
def on_this_machine(count: int) -> Iterator[Pool]:
    """Yield a pool of ``count`` threads, each with a process of its own; they end with the context."""
    processes = RunProcesses()
    executor = ThreadPoolExecutor(count, thread_name_prefix="run")
    try:
        yield Pool(executor, processes.answer_to, lambda: count)
    finally:
        executor.shutdown(wait=False, cancel_futures=True)
        processes.end()
        executor.shutdown(wait=True)


def missing() -> Diagnostic | None:
    """Finding that Dask is not installed; None if it is."""
    if find_spec("distributed"):
        return None
    message = "`--cluster` needs the package distributed, which is not installed"
    help_ = "install it with `pip install 'missionc[cluster]'`"
    return Diagnostic(EXTRA_MISSING, message, None, help=help_)


@contextmanager
def on_cluster(cluster: str) -> Iterator[Pool | Diagnostic]:
    """Yield the pool of a Dask cluster, or the finding that it is unreachable.

    A cluster that is started here ends with the context.
    """
    from distributed import Client

    _silence()
    local = LOCAL.fullmatch(cluster)
    try:
        client = _started(int(local[1])) if local else _connected(cluster)
    except (OSError, ValueError, TimeoutError) as error:
        yield _unreachable(cluster, str(error).splitlines()[0] if str(error) else type(error).__name__)
        return
    assert isinstance(client, Client)
    try:
        try:
            client.wait_for_workers(1, timeout=CONNECTION_PATIENCE)
        except TimeoutError:
            yield _unreachable(cluster, "no workers")
            return
        yield Pool(client.get_executor(pure=False), answer_to, lambda: _threads(client))
    finally:
        own = client.cluster
        for each in (client, own):
            with suppress(Exception):  # errors no longer matter
                if each is not None:
                    each.close(timeout=CONNECTION_PATIENCE)


def _connected(cluster: str) -> Client:
    from distributed import Client

    known: dict[str, Any] = {"address": cluster} if ADDRESS.fullmatch(cluster) else {"scheduler_file": cluster}
    return Client(**known, timeout=CONNECTION_PATIENCE, set_as_default=False)


def _started(count: int) -> Client:
    """Start ``count`` workers in processes of this machine, which ignore Ctrl-C."""
    import dask
    from distributed import Client, LocalCluster

    in_main = threading.current_thread() is threading.main_thread()
    before = signal.signal(signal.SIGINT, signal.SIG_IGN) if in_main else None
    try:
        with dask.config.set(UNWATCHED):
            cluster = LocalCluster(
                n_workers=count,
                threads_per_worker=1,
                processes=True,
                dashboard_address="127.0.0.1:0",
                silence_logs=logging.CRITICAL,
            )
        return Client(cluster, set_as_default=False)
    finally:
        if before is not None:
            signal.signal(signal.SIGINT, before)


def _threads(client: Client) -> int:
    try:
        return sum(map(int, client.nthreads().values()))
    except Exception:  # it has just gone away
        return 0


def _silence() -> None:
    """Suppress Dask's messages about workers, which its own logs contain."""
    for name in ("distributed", "tornado.application"):
        logging.getLogger(name).setLevel(logging.CRITICAL)


# ------------------------------------------------------------------ messages


def _unreachable(cluster: str, why: str) -> Diagnostic:
    help_ = "start a scheduler with `dask scheduler` and workers with `dask worker`"
    return Diagnostic(CLUSTER_UNREACHABLE, f"the cluster `{cluster}` cannot be used", None, notes=(why,), help=help_)


def not_done(why: str) -> Diagnostic:
    """Finding that a worker did not finish a request."""
    help_ = "run the same command again"
    return Diagnostic(CLUSTER_UNREACHABLE, "a worker did not finish its run", None, notes=(why,), help=help_)


def lost(why: str) -> Diagnostic:
    """Finding that the connection to the scheduler was lost."""
    help_ = "run the same command again; finished runs are saved"
    return Diagnostic(CLUSTER_UNREACHABLE, "the connection to the cluster was lost", None, notes=(why,), help=help_)


AHEAD = 4
"""Number of runs per worker that are submitted in advance."""
EVERY = 0.2
"""Seconds between two checks for an interruption."""
SYNCED = 1.0
"""Seconds between two flushes of written data to the disk."""


@dataclass(slots=True)
class Swept:
    """Result of the runs.

    Args:
        rows: finished runs.
        finding: reason for an early end, or None.
        interrupted: whether the runs were interrupted.
        seconds: run times, s.
    """

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
    """Do the remaining runs of a sweep, and write them to the journal.

    Args:
        left: remaining runs, in order.
        settings: settings of all runs.
        engines: engines that may plan each combination.
        rows: finished runs; new ones are added.
        pool: workers.
        journal: locked journal of the folder.
        folder: folder of the results.
        stop: called regularly; True to stop.
        listen: called with every finished run and the number of workers.
    """
    answers: queue.SimpleQueue[tuple[Run, Future[str]]] = queue.SimpleQueue()
    swept = Swept(rows)
    under_way: set[Future[str]] = set()
    again: Counter[Run] = Counter()

    def give(run: Run) -> None:
        text = run_request.run_request_text(Request(settings, dict(run.values), run.seed, engines.get(run.values, ())))
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
            if abandoned(done) and again[run] < AGAIN:
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
    """Row of a finished run, or the reason why no more will come."""
    answer = received_answers(done, settings.versions)
    return answer if isinstance(answer, Diagnostic) else Row(run, answer.result, answer.host)


def received_answers(done: Future[str], asked: Mapping[str, str]) -> Answer | Diagnostic:
    """Answer of a worker, possibly an error, or the reason why no worker will answer.

    Args:
        done: finished future.
        asked: requested versions.
    """
    try:
        answer = run_answer.read_run_answer(done.result())
    except CancelledError:
        return lost("it no longer has the submitted runs")
    except (ValueError, KeyError, TypeError) as error:
        return Answer(RunResult(ERROR, {"says": f"the answer cannot be read: {error}"}))
    except ImportError as error:
        return _other_versions("a worker", f"missing module: {error}")
    except Exception as error:
        if abandoned(done):
            return Answer(RunResult(ERROR, {"says": "every worker of this run ended unexpectedly"}))
        return lost(f"{type(error).__name__}: {error}")
    if not answer.versions:
        return answer
    names = sorted(name for name in {*answer.versions, *asked} if answer.versions.get(name) != asked.get(name))
    told = (f"{name} {answer.versions.get(name, 'missing')}, here {asked.get(name, 'missing')}" for name in names)
    return _other_versions(f"a worker on `{answer.host}`", "; ".join(told))


def _written(row: Row, journal: Journal, folder: Path, keep: bool) -> Diagnostic | None:
    """Write a run's plan and then its line in the journal; return an error of writing, or None.

    Args:
        row: finished run.
        journal: locked journal of the folder.
        folder: folder of the results.
        keep: whether to write the plan.
    """
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
    return Diagnostic(
        OTHER_VERSIONS, f"the package versions of {who} differ from this machine", None, notes=(why,), help=help_
    )
