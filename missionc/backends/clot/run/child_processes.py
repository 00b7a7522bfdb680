"""Pool of forked child processes, each a copy of this process at the time of the fork.

A fork costs milliseconds and contains all data built so far, so that only pieces of work and answers pass through
private pipes. A child works on one piece at a time, leaves Ctrl-C to this process, and always ends with it.
"""

from __future__ import annotations

import multiprocessing
import signal
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from multiprocessing.connection import Connection, wait
from multiprocessing.context import ForkProcess
from pathlib import Path
from typing import Any, Generic, NoReturn, TypeAlias, TypeVar

from missionc.backends.api import Progress
from missionc.base.memory import copies
from missionc.base.signals import end_with_parent, leave_signals
from missionc.base.supervision import STOPPING

Piece = TypeVar("Piece")
Answer = TypeVar("Answer")

Say: TypeAlias = Callable[[Progress], None]


class Children(Generic[Piece, Answer]):
    """Pool of child processes; the context ``children`` starts and ends them."""

    def __init__(self, work: Callable[[Piece, Say], Answer], listen: Say) -> None:
        self._work, self._listen = work, listen
        self._all: dict[Connection, ForkProcess] = {}

    def answers(
        self, pieces: Iterable[Piece], enough: Callable[[], bool] = lambda: False
    ) -> Iterator[tuple[int, Answer]]:
        """Yield the answer to each piece of work, with the index of the piece from 0, in the order of arrival.

        The next piece is taken when a child is idle. Unfinished pieces are dropped when ``enough`` returns true.

        Raises:
            MemoryError: a child had too little memory, or the system killed it.
            RuntimeError: a child failed; the message describes the error.
        """
        look = 0.2  # seconds between two checks of the deadline
        left = enumerate(pieces)
        idle = list(self._all)
        at_work: dict[Connection, int] = {}
        while True:
            while idle and (drawn := next(left, None)) is not None:
                self._send(idle[-1], drawn[1])
                at_work[idle.pop()] = drawn[0]
            if not at_work or enough():
                return
            for ready in (pipe for pipe in wait(list(at_work), look) if isinstance(pipe, Connection)):
                kind, content = self._receive(ready)
                if kind == "answer":
                    idle.append(ready)
                    yield at_work.pop(ready), content
                else:
                    self._listen(content)

    def start(self, count: int) -> None:
        """Start ``count`` child processes.

        Raises:
            MemoryError: there is not enough memory.
        """
        context = multiprocessing.get_context("fork")
        # No signal may reach a child that is not ready, nor this process before it knows of the child.
        before = signal.pthread_sigmask(signal.SIG_BLOCK, STOPPING)
        try:
            for _ in range(count):
                ours, theirs = context.Pipe()
                child = context.Process(target=_serve, args=(theirs, self._work), daemon=True)
                child.start()
                theirs.close()
                self._all[ours] = child
        except OSError as refused:
            raise MemoryError from refused
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)

    def end(self) -> None:
        """Kill all child processes, and wait until they have ended."""
        for child in self._all.values():
            child.kill()
        for pipe, child in self._all.items():
            child.join()
            pipe.close()

    def _send(self, pipe: Connection, piece: Piece) -> None:
        try:
            pipe.send(piece)
        except OSError:
            self._gone(pipe)

    def _receive(self, pipe: Connection) -> tuple[str, Any]:
        try:
            kind, content = pipe.recv()
        except (EOFError, OSError):
            self._gone(pipe)
        if kind == "memory":
            raise MemoryError
        if kind == "failure":
            raise RuntimeError(content)
        return kind, content

    def _gone(self, pipe: Connection) -> NoReturn:
        patience = 5.0  # seconds that a child may take to end
        child = self._all[pipe]
        child.join(patience)
        if child.exitcode == -signal.SIGKILL:  # the system's exit when memory is short
            raise MemoryError
        raise RuntimeError(f"a child process ended with status {child.exitcode}")


@contextmanager
def children(count: int, work: Callable[[Piece, Say], Answer], listen: Say) -> Iterator[Children[Piece, Answer]]:
    """Context with a pool of child processes for one kind of work, as many as the memory limit allows.

    Args:
        count: number of child processes.
        work: function that a child calls for each piece, on its own copy of all data. Pieces and answers have types
            that ``multiprocessing`` supports.
        listen: receives the progress messages of the children.

    Raises:
        MemoryError: there is not enough memory.
    """
    made = Children(work, listen)
    try:
        made.start(copies(count))
        yield made
    finally:
        made.end()


def _serve(pipe: Connection, work: Callable[[Any, Say], Any]) -> None:
    leave_signals()
    signal.pthread_sigmask(signal.SIG_UNBLOCK, STOPPING)
    end_with_parent()

    def say(progress: Progress) -> None:
        pipe.send(("word", progress))

    with suppress(EOFError, OSError):  # only of the pipe: the parent is gone
        while True:
            piece = pipe.recv()
            pipe.send(_done(piece, work, say))


def _done(piece: Any, work: Callable[[Any, Say], Any], say: Say) -> tuple[str, Any]:
    try:
        return "answer", work(piece, say)
    except MemoryError:
        return "memory", None
    except Exception as error:
        return "failure", _described(error)


def _described(error: Exception) -> str:
    place = error.__traceback__
    while place and place.tb_next:
        place = place.tb_next
    where = f" at {Path(place.tb_frame.f_code.co_filename).name}:{place.tb_lineno}" if place else ""
    return f"{type(error).__name__}{where} in a child process: {error}"
