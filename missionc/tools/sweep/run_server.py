"""Server process of a worker, which loads all modules once and forks for each run of a sweep.

in   on standard input a request on each line (``run_request``, ``trial_request``)
out  on standard output a line for each: the answer (``run_answer``)

Each run has its own process, with its own limits of time and memory; runs cannot affect each other, and every end of a
run is an answer. This process has one thread, so that forks are safe. If the requester goes away, it ends with its
current run; a fork ends with this process.

Run as ``python -m missionc.tools.sweep.run_server FOLDER``; the folder, for temporary files, is removed at the end.
"""

from __future__ import annotations

import gc
import os
import resource
import select
import shutil
import signal
import sys
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import suppress

from missionc.base.signals import leave_signals
from missionc.base.strict_json import parse_record
from missionc.tools.sweep import run_answer, run_request, trial_request
from missionc.tools.sweep.run_answer import RunResult

GRACE = 30.0
"""Seconds by which a run may exceed its limits before its process is killed."""
READ = 1 << 16


def serve(requests: int, answers: int) -> None:
    """Answer requests until there are no more.

    Args:
        requests, answers: file descriptors.
    """
    with open(requests, "rb", buffering=READ) as lines:
        while line := lines.readline():
            write_all(answers, _answer(line.decode("ascii"), requests).encode("ascii") + b"\n")


def write_all(handle: int, content: bytes) -> None:
    view = memoryview(content)
    while view:
        view = view[os.write(handle, view) :]


def _answer(text: str, requests: int) -> str:
    try:
        document = parse_record(text)
        carry_out = KINDS[document["schema"]]
        seconds, engines, asked = float(document["seconds"]), tuple(document["engines"]), dict(document["versions"])
    except (ValueError, KeyError, TypeError) as error:
        return run_answer.failed(f"the request cannot be read: {type(error).__name__}: {error}")
    here = run_answer.versions_here()
    if asked and asked != here:
        return run_answer.other_versions(here)
    _load(document["schema"], engines)
    return _forked(text, carry_out, seconds, requests)


def _carry_out_run(text: str) -> RunResult:
    from missionc.tools.sweep.carry_out_run import carry_out

    return carry_out(run_request.read_run_request(text))


def _carry_out_trials(text: str) -> RunResult:
    from missionc.tools.sweep.carry_out_trials import fly_trials

    return fly_trials(trial_request.read_trial_request(text))


KINDS: dict[str, Callable[[str], RunResult]] = {
    run_request.SCHEMA: _carry_out_run,
    trial_request.SCHEMA: _carry_out_trials,
}
"""Function that handles a request, by its schema."""


def _load(schema: str, engines: Sequence[str]) -> None:
    """Load the modules for a kind of request before any fork; the run reports missing ones.

    Args:
        schema: schema of the request.
        engines: engines that may be needed; empty for all.
    """
    if schema == trial_request.SCHEMA:
        from missionc.tools.sweep import carry_out_trials

        _ = carry_out_trials
        return
    from missionc.backends.load import load_engines
    from missionc.backends.options import Options
    from missionc.output import output_files
    from missionc.tools.sweep import carry_out_run
    from missionc.verification import verify_plan

    _ = output_files, verify_plan, carry_out_run
    if engines:
        load_engines(tuple(engines), Options(), False)


def _forked(text: str, carry_out: Callable[[str], RunResult], seconds: float, requests: int) -> str:
    """Answer to a request, computed by a fork of this process.

    Args:
        text: request.
        carry_out: function that handles it.
        seconds: time limit, after which the fork is killed.
        requests: file descriptor, which closes if the requester goes away.
    """
    read_end, write_end = os.pipe()
    alive, life = os.pipe()
    gc.freeze()
    began = time.monotonic()
    child = os.fork()
    if child == 0:
        try:
            os.close(read_end)
            os.close(life)
            _alone(alive, requests)
            write_all(write_end, _carried_out(text, carry_out).encode("ascii") + b"\n")
        finally:
            os._exit(0)
    os.close(write_end)
    os.close(alive)
    try:
        answer, late = _heard(read_end, requests, began + 1.05 * seconds + GRACE)
    finally:
        with suppress(OSError):
            os.killpg(child, signal.SIGKILL)  # processes that it left behind
        os.close(read_end)
        os.close(life)
        _, status, usage = os.wait4(child, 0)
    if late:
        return run_answer.failed("the run exceeded its time limit and was ended")
    if not answer.endswith(b"\n"):
        return run_answer.failed(f"the run's process {_ended(status)}")
    return run_answer.with_usage(answer.decode("ascii"), usage.ru_utime + usage.ru_stime, usage.ru_maxrss << 10)


def _alone(alive: int, requests: int) -> None:
    """Give the fork its own session and standard streams, and end it with its parent.

    Args:
        alive: file descriptor, which closes when the parent ends.
        requests: file descriptor of requests, which the fork must not read.
    """
    os.setsid()
    leave_signals()
    nothing = os.open(os.devnull, os.O_RDWR)
    os.dup2(nothing, requests)

    def wait() -> None:
        with suppress(OSError):
            os.read(alive, 1)
        os.killpg(0, signal.SIGKILL)

    threading.Thread(target=wait, daemon=True).start()


def _carried_out(text: str, carry_out: Callable[[str], RunResult]) -> str:
    try:
        return run_answer.run_answer_text(carry_out(text))
    except MemoryError:
        return run_answer.failed("out of memory")
    except Exception as error:
        return run_answer.failed(f"internal error: {type(error).__name__}: {error}")


def _heard(read_end: int, requests: int, deadline: float) -> tuple[bytes, bool]:
    """Output of the fork, and whether its time ran out.

    Args:
        read_end: file descriptor of the output.
        requests: file descriptor, which closes if the requester goes away.
        deadline: in terms of ``time.monotonic()``.
    """
    heard = bytearray()
    while not heard.endswith(b"\n"):
        left = deadline - time.monotonic()
        ready = select.select([read_end, requests], [], [], max(0.0, left))[0]
        if not ready:
            return bytes(heard), True
        if requests in ready:  # the requester is gone
            raise SystemExit
        more = os.read(read_end, READ)
        if not more:
            break
        heard += more
    return bytes(heard), False


def _ended(status: int) -> str:
    code = os.waitstatus_to_exitcode(status)
    return f"ended with signal {-code}" if code < 0 else f"ended with status {code} without an answer"


def main() -> None:
    """Serve on standard input and output; other output goes to standard error."""
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    answers = os.dup(1)
    os.dup2(2, 1)
    serve(0, answers)


if __name__ == "__main__":
    try:
        main()
    finally:
        for room in sys.argv[1:]:
            shutil.rmtree(room, ignore_errors=True)
        os._exit(0)
