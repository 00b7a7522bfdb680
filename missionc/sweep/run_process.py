"""The worker's side of a run: a text goes to a process of this thread's own, and its answer comes back.

What an executor calls takes a text and gives one, so that nothing else has to
travel. The process (``run_server``) stays for the next run; where it dies,
another one takes the run over, once.
"""

from __future__ import annotations

import os
import subprocess
import sys
import threading
from contextlib import suppress
from pathlib import Path
from tempfile import TemporaryDirectory

from missionc.sweep import run_answer

TRIES = 2
"""Processes that a run is given to, one after the other, where they die."""
PATIENCE = 5.0
"""Seconds that a process may take to end once nobody asks it any more."""
SERVER = "missionc.sweep.run_server"
HOME = Path(__file__).resolve().parents[2]
"""Where this package lies: the process is to have the same one."""


class RunProcess:
    """A process that answers requests one after the other; it is started with the first."""

    def __init__(self) -> None:
        self._room = TemporaryDirectory(prefix="missionc-sweep-", ignore_cleanup_errors=True)
        self._process = _started(self._room.name)

    def ask(self, request: str) -> str:
        """The answer; empty where the process died first."""
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
        """End it, with the run under way; from whichever thread."""
        process = self._process
        process.terminate()
        try:
            process.wait(PATIENCE)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        for stream in (process.stdin, process.stdout):
            with suppress(OSError, ValueError):
                assert stream is not None
                stream.close()
        self._room.cleanup()


class RunProcesses:
    """The processes of some threads, one each: none before its thread asks, and none once they are ended."""

    def __init__(self) -> None:
        self._own = threading.local()
        self._all: set[RunProcess] = set()
        self._lock = threading.Lock()
        self._ended = False

    def answer_to(self, request: str) -> str:
        """The answer to a request (``run_request.written``), as a text that ``run_answer.read`` reads."""
        for _ in range(TRIES):
            process = self._of_this_thread()
            if process is None:
                return run_answer.failed("the run was interrupted")
            answer = process.ask(request)
            if answer:
                return answer
            self._forget(process)
        return run_answer.failed(f"the process of the run died, {TRIES} times")

    def end(self) -> None:
        """End them all, with the runs under way."""
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


def _started(room: str) -> subprocess.Popen[bytes]:
    path = os.pathsep.join(filter(None, (str(HOME), os.environ.get("PYTHONPATH", ""))))
    return subprocess.Popen(  # noqa: S603 (our own interpreter, and our own module)
        [sys.executable, "-P", "-m", SERVER, room],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        env={**os.environ, "PYTHONPATH": path, "TMPDIR": room},
        start_new_session=True,  # Ctrl-C is the parent's to act on
    )


_here = RunProcesses()


def answer_to(request: str) -> str:
    """``RunProcesses.answer_to`` of this process, for a worker that is told no more than a function's name."""
    return _here.answer_to(request)
