"""Planner process for successive compilations: a new request stops the current one.

Its results go to the terminal, as in ``compile``, or only to the caller (``aloud``). A process is prepared in advance,
since loading the planner takes about a second. It leaves Ctrl-C on the terminal to its parent, and ends with it.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import time
from collections.abc import Callable
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnProcess
from typing import TYPE_CHECKING, Self

from missionc.base.diagnostics.defect import defect
from missionc.base.diagnostics.model import Diagnostic
from missionc.base.diagnostics.render import render_text
from missionc.base.late_dataclass import Record
from missionc.base.signals import Stopped, end_with_parent, stoppable
from missionc.base.supervision import HANDLED
from missionc.base.units import Seconds
from missionc.cli.compile_request import CompileRequest
from missionc.cli.exit_status import Status, say
from missionc.cli.progress import EVERY, words

if TYPE_CHECKING:
    from missionc.backends.api import Progress

PATIENCE = (0.5, 2.0)
"""Seconds that a process may take for cleanup after a first SIGTERM, and to end after a second one."""


class Ended(Record):
    """Result of a request: exit status, findings as text and as values, and the written folder.

    ``lines`` is the summary of the plan or of its absence, without the files.
    """

    status: int
    says: str
    findings: tuple[Diagnostic, ...] = ()
    output: str = ""
    lines: tuple[str, ...] = ()

    @property
    def codes(self) -> tuple[str, ...]:
        return tuple(finding.code.name for finding in self.findings)


class Planner:
    """Context manager that compiles requests in a separate process; at its end no process is left."""

    def __init__(self, aloud: bool = True) -> None:
        self._aloud = aloud
        self._child: _Child | None = None
        self._at_work = False

    @property
    def progress(self) -> str:
        """Progress of the current request in one line; empty if unknown, or if the process prints it itself."""
        return self._child.progress if self._child is not None else ""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exception: object) -> None:
        self._end()

    def ready(self, backend: str) -> None:
        """Start a process that loads the planner for a backend in advance."""
        if self._child is not None and self._child.backend != backend:
            self._end()
        if self._child is None:
            self._child = _Child(backend, self._aloud)

    def start(self, request: CompileRequest, backend: str) -> None:
        """Start a request, and stop the current one.

        Args:
            request: input, options and outputs.
            backend: name of the backend that will be used.
        """
        self.stop()
        self.ready(backend)
        assert self._child is not None
        self._child.send(request)
        self._at_work = True

    def ended(self) -> Ended | None:
        """Result of the current request; None until it has ended."""
        if self._child is None or not self._at_work or (ended := self._child.answer()) is None:
            return None
        self.stop()
        return ended

    def stop(self) -> None:
        """Stop the current request and prepare another process; the next plan removes unfinished files."""
        if self._child is not None and self._at_work:
            backend = self._child.backend
            self._end()
            self.ready(backend)

    def _end(self) -> None:
        if self._child is not None:
            self._child.end()
        self._child, self._at_work = None, False


class _Child:
    """Process that carries out one request."""

    def __init__(self, backend: str, aloud: bool) -> None:
        self.backend = backend
        self.progress = ""
        context = multiprocessing.get_context("spawn")
        self._pipe, theirs = context.Pipe()
        self._process: SpawnProcess = context.Process(target=_work, args=(theirs, backend, aloud))
        # No signal may reach a child that is not ready for it.
        before = signal.pthread_sigmask(signal.SIG_BLOCK, HANDLED)
        try:
            self._process.start()
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)
            theirs.close()

    def send(self, request: CompileRequest) -> None:
        self._pipe.send(request)

    def answer(self) -> Ended | None:
        """Result that the process sent, or a substitute if it ended without one; None while it is running."""
        try:
            while self._pipe.poll():
                answer = self._pipe.recv()
                if isinstance(answer, Ended):
                    return answer
                self.progress = answer
        except (EOFError, OSError):
            self._process.join()
            return Ended(Status.DEFECT, f"the planning process ended with status {self._process.exitcode}\n")
        return None

    def end(self) -> None:
        """End the process: a first SIGTERM lets it clean up, a second one ends it immediately."""
        self._pipe.close()
        for patience in PATIENCE:
            self._process.terminate()
            self._process.join(patience)
        self._process.kill()
        self._process.join()
        self._process.close()


def _work(pipe: Connection, backend: str, aloud: bool) -> None:
    os.setsid()
    end_with_parent()
    try:
        with stoppable():
            signal.pthread_sigmask(signal.SIG_UNBLOCK, HANDLED)
            _load(backend)
            pipe.send(_run_request(pipe.recv(), None if aloud else _teller(pipe)))
    except (Stopped, EOFError, BrokenPipeError):
        return  # the answer is no longer needed


def _load(backend: str) -> None:
    from missionc.backends.load import load
    from missionc.backends.options import Options
    from missionc.output import output_files
    from missionc.verification import verify_plan

    _ = output_files, verify_plan
    load(backend, Options(), False)


def _teller(pipe: Connection) -> Callable[[Progress], None]:
    """Function that sends progress to the parent, at most every ``EVERY`` seconds."""
    next_time = 0.0

    def tell(progress: Progress) -> None:
        nonlocal next_time
        if time.monotonic() >= next_time:
            next_time = time.monotonic() + EVERY
            pipe.send(words(progress))

    return tell


def _run_request(request: CompileRequest, listen: Callable[[Progress], None] | None) -> Ended:
    """Carry out a request; without a listener, print its results as on the command line.

    Args:
        request: input, options and outputs.
        listen: called with the progress, or None.
    """
    from missionc.cli.compile_request import carry_out, run_request
    from missionc.cli.summary import compiled_lines

    began = time.monotonic()
    try:
        answer = run_request(request) if listen is None else carry_out(request, request.deadline, listen)
    except Exception as error:
        finding = defect(error)
        if listen is None:
            say([finding], [], request.form, {})
        return Ended(Status.DEFECT, render_text([finding], False), (finding,))
    findings = answer.compiled.findings
    lines = tuple(compiled_lines(answer.compiled, "", Seconds(time.monotonic() - began), verbose=False))
    return Ended(answer.status, render_text(list(findings), False), findings, answer.output, lines)
