"""A planner process for one compilation after the other: the newest request counts, the one before is stopped.

A process is ready before it is needed: loading what plans takes about a second, in which nobody
should have to wait. It leaves Ctrl-C on the terminal to its parent, and ends with it.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
from dataclasses import dataclass
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnProcess
from typing import Self

from missionc.base.signals import HANDLED, Stopped, end_with_parent, stoppable
from missionc.cli.compile_request import CompileRequest
from missionc.cli.exit_status import Status, defect, say
from missionc.diagnostics.render import render_text

PATIENCE = (0.5, 2.0)
"""Seconds to tidy up after a first SIGTERM, and to end after a second one."""


@dataclass(frozen=True, slots=True)
class Ended:
    """The end of a request: the status, the findings as text, their codes, and the folder written."""

    status: int
    says: str
    codes: tuple[str, ...] = ()
    output: str = ""


class Planner:
    """A context in which requests are carried out; afterwards nothing is under way."""

    def __init__(self) -> None:
        self._child: _Child | None = None
        self._at_work = False

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exception: object) -> None:
        self._end()

    def ready(self, backend: str) -> None:
        """Have a process that has loaded what plans such a mission, and waits."""
        if self._child is not None and self._child.backend != backend:
            self._end()
        if self._child is None:
            self._child = _Child(backend)

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

    def __init__(self, backend: str) -> None:
        self.backend = backend
        context = multiprocessing.get_context("spawn")
        self._pipe, theirs = context.Pipe()
        self._process: SpawnProcess = context.Process(target=_work, args=(theirs, backend))
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
        if not self._pipe.poll():
            return None
        try:
            answer = self._pipe.recv()
        except (EOFError, OSError):
            self._process.join()
            return Ended(Status.DEFECT, f"the planning process ended with status {self._process.exitcode}\n")
        assert isinstance(answer, Ended)
        return answer

    def end(self) -> None:
        """The first SIGTERM lets it tidy up, the second one ends it wherever it is, as on the command line."""
        self._pipe.close()
        for patience in PATIENCE:
            self._process.terminate()
            self._process.join(patience)
        self._process.kill()
        self._process.join()
        self._process.close()


def _work(pipe: Connection, backend: str) -> None:
    os.setsid()
    end_with_parent()
    try:
        with stoppable():
            signal.pthread_sigmask(signal.SIG_UNBLOCK, HANDLED)
            _load(backend)
            pipe.send(_run_request(pipe.recv()))
    except (Stopped, EOFError, BrokenPipeError):
        return  # nobody waits for an answer any more


def _load(backend: str) -> None:
    from missionc.backends.load import load
    from missionc.backends.options import Options
    from missionc.output import output_files
    from missionc.verify import verify_plan

    _ = output_files, verify_plan
    load(backend, Options(), False)


def _run_request(request: CompileRequest) -> Ended:
    from missionc.cli.compile_request import run_request

    try:
        answer = run_request(request)
    except Exception as error:
        finding = defect(error)
        say([finding], [], request.form, {})
        return Ended(Status.DEFECT, render_text([finding], False), (finding.code.name,))
    findings = list(answer.compiled.findings)
    codes = tuple(finding.code.name for finding in findings)
    return Ended(answer.status, render_text(findings, False), codes, answer.output)
