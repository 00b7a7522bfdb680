"""Executors of a sweep's runs, each a ``concurrent.futures.Executor``: processes of this machine, or a Dask cluster.

    in   how many processes, or the address of a cluster
    out  Pool
    says MC404 MC764

Whichever it is, a text goes to it and a text comes back; it is Dask's scheduler
that knows who has time, and gives the runs of a worker that dies to others.
"""

from __future__ import annotations

import logging
import os
import re
import signal
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

from missionc.diagnostics.code import CLUSTER_UNREACHABLE, EXTRA_MISSING
from missionc.diagnostics.model import Diagnostic
from missionc.sweep import run_process

if TYPE_CHECKING:
    from distributed import Client

LOCAL = re.compile(r"local:(\d+)")
ADDRESS = re.compile(r"[a-z][a-z+]*://\S+")
MOST_WORKERS = 1024
"""Processes that are started here."""
UNWATCHED = {"distributed.worker.profile.enabled": False, "distributed.admin.tick.interval": "500 ms"}
"""Settings of a cluster that is started here: nobody looks at a profile of workers that wait for a process."""
AGAIN = 4
"""Times that a request is given to a cluster once more that gave it up."""
PATIENCE = 10.0
"""Seconds to reach a scheduler, and then for its first worker."""


@dataclass(frozen=True, slots=True)
class Pool:
    """An executor, what it is to call, and how many runs it has under way at once now."""

    executor: Executor
    answer_to: Callable[[str], str]
    workers: Callable[[], int]

    def submit(self, text: str) -> Future[str]:
        """The answer to be, to a request."""
        return self.executor.submit(self.answer_to, text)


def abandoned(done: Future[str]) -> bool:
    """Whether Dask gave a request up, since as many workers as it allows died while they had it.

    Most of them had not begun with it: it is worth another try.
    """
    return not done.cancelled() and type(done.exception()).__name__ == "KilledWorker"


def processors() -> int:
    """Processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def understood(cluster: str) -> bool:
    """Whether this names a cluster: ``local:8``, the address of a scheduler, or a file that has it."""
    local = LOCAL.fullmatch(cluster)
    if local:
        return 1 <= int(local[1]) <= MOST_WORKERS
    return ADDRESS.fullmatch(cluster) is not None or Path(cluster).is_file()


@contextmanager
def on_this_machine(count: int) -> Iterator[Pool]:
    """So many threads, each of which waits for a process of its own; they end with this."""
    processes = run_process.RunProcesses()
    executor = ThreadPoolExecutor(count, thread_name_prefix="run")
    try:
        yield Pool(executor, processes.answer_to, lambda: count)
    finally:
        executor.shutdown(wait=False, cancel_futures=True)
        processes.end()
        executor.shutdown(wait=True)


def missing() -> Diagnostic | None:
    """What to say where there is no Dask; absent where there is."""
    if find_spec("distributed"):
        return None
    message = "`--cluster` needs the package distributed, which is not installed"
    help_ = "install it with `pip install 'missionc[cluster]'`, or leave `--cluster` out"
    return Diagnostic(EXTRA_MISSING, message, None, help=help_)


@contextmanager
def on_cluster(cluster: str) -> Iterator[Pool | Diagnostic]:
    """The workers of a Dask cluster; of one that is started here, they end with this."""
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
            client.wait_for_workers(1, timeout=PATIENCE)
        except TimeoutError:
            yield _unreachable(cluster, "it has no worker")
            return
        yield Pool(client.get_executor(pure=False), run_process.answer_to, lambda: _threads(client))
    finally:
        own = client.cluster
        for each in (client, own):
            with suppress(Exception):  # whatever is wrong with it, nobody asks it any more
                if each is not None:
                    each.close(timeout=PATIENCE)


def _connected(cluster: str) -> Client:
    from distributed import Client

    known: dict[str, Any] = {"address": cluster} if ADDRESS.fullmatch(cluster) else {"scheduler_file": cluster}
    return Client(**known, timeout=PATIENCE, set_as_default=False)


def _started(count: int) -> Client:
    """Workers in processes of this machine, which leave Ctrl-C to this one."""
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
    except Exception:  # it is just now away
        return 0


def _silence() -> None:
    """Keep what Dask says of workers that come and go from standing between lines of ours; its own logs have it."""
    for name in ("distributed", "tornado.application"):
        logging.getLogger(name).setLevel(logging.CRITICAL)


# ------------------------------------------------------------------ messages


def _unreachable(cluster: str, why: str) -> Diagnostic:
    help_ = "start a scheduler with `dask scheduler` and workers with `dask worker`, or leave `--cluster` out"
    return Diagnostic(CLUSTER_UNREACHABLE, f"the cluster `{cluster}` cannot be used", None, notes=(why,), help=help_)


def not_done(why: str) -> Diagnostic:
    """What to say where a worker did not bring to an end what it was given."""
    help_ = "give the same command again, or one with fewer processes where their memory did not suffice"
    return Diagnostic(CLUSTER_UNREACHABLE, "a worker did not do what it was given", None, notes=(why,), help=help_)


def lost(why: str) -> Diagnostic:
    """What to say where the scheduler is no longer there."""
    help_ = "give the same command again once it is there: what is done is kept"
    return Diagnostic(CLUSTER_UNREACHABLE, "the cluster was lost", None, notes=(why,), help=help_)
