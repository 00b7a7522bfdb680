"""A planner process for one compilation after the other: the newest request counts, the one before is stopped.

Its results go to the terminal, as those of ``compile`` do, or only to whoever asks for them (``aloud``).
A process is ready before it is needed: loading what plans takes about a second, in which nobody
should have to wait. It leaves Ctrl-C on the terminal to its parent, and ends with it.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import time
from collections.abc import Callable
from dataclasses import dataclass
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnProcess
from typing import TYPE_CHECKING, Self

from missionc.base.diagnostics.defect import defect
from missionc.base.diagnostics.model import Diagnostic
from missionc.base.diagnostics.render import render_text
from missionc.base.signals import Stopped, end_with_parent, stoppable
from missionc.base.supervision import HANDLED
from missionc.base.units import Seconds
from missionc.cli.compile_request import CompileRequest
from missionc.cli.exit_status import Status, say
from missionc.cli.progress import EVERY, words

if TYPE_CHECKING:
    from missionc.backends.api import Progress

PATIENCE = (0.5, 2.0)
"""Seconds to tidy up after a first SIGTERM, and to end after a second one."""


@dataclass(frozen=True, slots=True)
class Ended:
    """The end of a request: the status, the findings as text and as they are, and the folder written.

    ``lines`` is the summary of the plan, or of why there is none, but for the files.
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
    """A context in which requests are carried out; afterwards nothing is under way."""

    def __init__(self, aloud: bool = True) -> None:
        self._aloud = aloud
        self._child: _Child | None = None
        self._at_work = False

    @property
    def progress(self) -> str:
        """Where the request under way is, in a line; empty where nobody knows, and of one that is done aloud."""
        return self._child.progress if self._child is not None else ""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exception: object) -> None:
        self._end()

    def ready(self, backend: str) -> None:
        """Have a process that has loaded what plans such a mission, and waits."""
        if self._child is not None and self._child.backend != backend:
            self._end()
        if self._child is None:
            self._child = _Child(backend, self._aloud)

    def start(self, request: CompileRequest, backend: str) -> None:
        """Begin with a request, and leave the one before."""
        self.stop()
        self.ready(backend)
        assert self._child is not None
        self._child.send(request)
        self._at_work = True

    def ended(self) -> Ended | None:
        """The end of the request under way, once it has ended."""
        if self._child is None or not self._at_work or (ended := self._child.answer()) is None:
            return None
        self.stop()
        return ended

    def stop(self) -> None:
        """Leave what is under way, and be ready. What is half-written then, the next plan tidies up."""
        if self._child is not None and self._at_work:
            backend = self._child.backend
            self._end()
            self.ready(backend)

    def _end(self) -> None:
        if self._child is not None:
            self._child.end()
        self._child, self._at_work = None, False


class _Child:
    """One process, for one request."""

    def __init__(self, backend: str, aloud: bool) -> None:
        self.backend = backend
        self.progress = ""
        context = multiprocessing.get_context("spawn")
        self._pipe, theirs = context.Pipe()
        self._process: SpawnProcess = context.Process(target=_work, args=(theirs, backend, aloud))
        # No signal may meet a child that is not ready for it.
        before = signal.pthread_sigmask(signal.SIG_BLOCK, HANDLED)
        try:
            self._process.start()
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)
            theirs.close()

    def send(self, request: CompileRequest) -> None:
        self._pipe.send(request)

    def answer(self) -> Ended | None:
        """Its answer, if it has one; one in its place where it ended without."""
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
        """The first SIGTERM lets it tidy up, the second one ends it wherever it is, as on the command line."""
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
        return  # nobody waits for an answer any more


def _load(backend: str) -> None:
    from missionc.backends.load import load
    from missionc.backends.options import Options
    from missionc.output import output_files
    from missionc.verification import verify_plan

    _ = output_files, verify_plan
    load(backend, Options(), False)


def _teller(pipe: Connection) -> Callable[[Progress], None]:
    """A listener that tells the parent how far it is, not more often than anybody reads it."""
    next_time = 0.0

    def tell(progress: Progress) -> None:
        nonlocal next_time
        if time.monotonic() >= next_time:
            next_time = time.monotonic() + EVERY
            pipe.send(words(progress))

    return tell


def _run_request(request: CompileRequest, listen: Callable[[Progress], None] | None) -> Ended:
    """Aloud, as on the command line, where nobody listens."""
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
