"""Trials in processes of their own, with limits of time and memory.

in   Kind, Case
out  Answer: a hang, a crash of the interpreter and a remaining process are faults as well

The process is a copy of this one, which has everything loaded, and leads a session, by which what it starts is found.
"""

from __future__ import annotations

import ctypes
import faulthandler
import json
import os
import resource
import select
import signal
import sys
import tempfile
import time
import traceback
from dataclasses import asdict
from pathlib import Path
from types import FrameType
from typing import IO, Any, NoReturn

from farm.trial import Answer, Broken, Case, Fault, Kind

MEMORY = 6 << 30
"""Memory limit of a trial's process, bytes."""
MOST_SEEN = 4_000
"""Maximum number of characters stored about a fault."""
TO_SAY_WHERE = 0.5
"""Seconds for a hung process to report its place before it is killed."""
DIE_WITH_PARENT = 1
"""PR_SET_PDEATHSIG of Linux."""
ROOT = Path(__file__).resolve().parents[1]


def carried_out(kind: Kind, case: Case, memory: int = MEMORY) -> Answer:
    """Result of a case in a process of its own, which ends with all of its children."""
    begin = time.monotonic()
    with tempfile.TemporaryDirectory(prefix="farm-") as home, tempfile.TemporaryFile("w+") as said:
        read, write = os.pipe()
        process = os.fork()
        if process == 0:
            os.close(read)
            _carry_out(kind, case, Path(home), write, said, memory)
        os.close(write)
        document = _read(read, kind.seconds)
        if document is None:
            os.kill(process, signal.SIGUSR1)
            time.sleep(TO_SAY_WHERE)
            os.kill(process, signal.SIGKILL)
        status = os.waitpid(process, 0)[1]
        left = session(process)
        for each in left:
            os.kill(each, signal.SIGKILL)
        seconds = time.monotonic() - begin
        if document:
            answer = json.loads(document)
            fault = answer["fault"] and Fault(**answer["fault"])
            if left and not fault:
                promise = "All child processes end with their command."
                fault = Fault(f"{kind.name}: left over", promise, f"{len(left)} processes still run")
            return Answer(answer["outcome"], seconds, fault)
        said.seek(0)
        return Answer("died", seconds, _death(kind, status, said.read(), document is None))


def fault_of(kind: str, error: BaseException) -> Fault:
    """Fault for an exception from a trial."""
    seen = "".join(traceback.format_exception(error))[-MOST_SEEN:]
    if isinstance(error, Broken):
        return Fault(f"{kind}: {error.referee}", error.promise, error.seen[:MOST_SEEN])
    where = _innermost(error)
    promise = "No command ends with an unexpected error."
    if isinstance(error, AssertionError) and not where.startswith("missionc/"):
        promise = "The commands answer as documented, and their answers agree."
    return Fault(f"{kind}: {type(error).__name__} in {where}", promise, seen)


def _innermost(error: BaseException) -> str:
    """Innermost function of an error, preferably in the compiler."""
    frames = traceback.extract_tb(error.__traceback__)
    places = [(Path(frame.filename), frame.name) for frame in frames]
    ours = [
        f"{path.relative_to(ROOT).as_posix()}:{name}"
        for path, name in places
        if path.is_relative_to(ROOT) and ".venv" not in path.parts
    ]
    compiler = [place for place in ours if place.startswith("missionc/")]
    return (compiler or ours or ["nowhere"])[-1]


# ------------------------------------------------------------------- the child


def _carry_out(kind: Kind, case: Case, home: Path, answer: int, said: IO[str], memory: int) -> NoReturn:
    status = 1
    try:
        os.setsid()
        ctypes.CDLL(None).prctl(DIE_WITH_PARENT, signal.SIGKILL)
        _quiet(said)
        resource.setrlimit(resource.RLIMIT_DATA, (memory, memory))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        faulthandler.enable(said)
        faulthandler.register(signal.SIGUSR1, said)
        os.environ["MISSIONC_TRACEBACK"] = "1"
        os.chdir(home)
        fault, outcome = None, "fault"
        try:
            outcome = kind.carry_out(case, home)
        except BaseException as error:
            fault = fault_of(kind.name, error)
        document: dict[str, Any] = {"outcome": outcome, "fault": asdict(fault) if fault else None}
        with os.fdopen(answer, "wb") as stream:
            stream.write(json.dumps(document).encode())
        status = 0
    finally:
        os._exit(status)


def _quiet(said: IO[str]) -> None:
    """Redirect standard input to nothing and output to a file."""
    nothing = os.open(os.devnull, os.O_RDONLY)
    for stream, target in ((0, nothing), (1, said.fileno()), (2, said.fileno())):
        os.dup2(target, stream)
    sys.stdin = open(0, closefd=False)  # noqa: SIM115
    sys.stdout = open(1, "w", closefd=False)  # noqa: SIM115
    sys.stderr = open(2, "w", closefd=False)  # noqa: SIM115
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, _ended)


def _ended(number: int, frame: FrameType | None) -> NoReturn:
    """End a trial without a finding if its process is ended from outside."""
    os._exit(0)


# ------------------------------------------------------------------ the parent


def _read(pipe: int, seconds: float) -> bytes | None:
    """Contents of a pipe until it is closed; None after a timeout."""
    end, found = time.monotonic() + seconds, b""
    try:
        while (left := end - time.monotonic()) > 0 and select.select([pipe], [], [], left)[0]:
            part = os.read(pipe, 1 << 16)
            if not part:
                return found
            found += part
        return None
    finally:
        os.close(pipe)


def session(leader: int) -> list[int]:
    """Living processes that a trial's process started, directly or indirectly."""
    found = []
    for entry in Path("/proc").glob("[0-9]*"):
        try:
            state, _, _, session = (entry / "stat").read_text().rpartition(")")[2].split()[:4]
        except OSError:
            continue
        if int(session) == leader and state != "Z":
            found.append(int(entry.name))
    return found


def _death(kind: Kind, status: int, said: str, hung: bool) -> Fault | None:
    where = next((line.strip() for line in said.splitlines() if "missionc/" in line and "File" in line), "nowhere")
    function = where.rpartition(" in ")[2]
    if hung:
        promise = f"A trial of this kind ends within {kind.seconds:g} s."
        return Fault(f"{kind.name}: no end in {function}", promise, said[-MOST_SEEN:])
    if os.WIFSIGNALED(status):
        name = signal.Signals(os.WTERMSIG(status)).name
        return Fault(f"{kind.name}: {name} in {function}", "The interpreter never crashes.", said[-MOST_SEEN:])
    if os.WEXITSTATUS(status):
        promise = "No command ends its own process."
        return Fault(f"{kind.name}: exit {os.WEXITSTATUS(status)}", promise, said[-MOST_SEEN:])
    return None
