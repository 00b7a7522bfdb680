"""Memory of this process: the amount it holds, and a limit on the amount it may take.

Only Linux tells and limits it; elsewhere 0 is held, and nothing is limited.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

DEFAULT_LIMIT = 8 << 30
"""Default memory limit of a command, bytes."""

ROOM = 128 << 20
"""Bytes that a process may take in any case, whatever the limit: less would not even hold a message."""


def held() -> int:
    """Bytes of this process's own that are in memory now."""
    return _status("RssAnon")


@contextmanager
def limited(size: int) -> Iterator[None]:
    """Within, this process cannot hold much more than ``size`` bytes: what asks for more gets a ``MemoryError``.

    What was there before counts, but half of ``size`` is left to take in any case.
    """
    if sys.platform != "linux":
        yield
        return
    import resource

    before = resource.getrlimit(resource.RLIMIT_DATA)
    mapped = _status("VmData")
    allowed = max(size, mapped + size // 2, mapped + ROOM)
    known = [limit for limit in before if limit != resource.RLIM_INFINITY]
    resource.setrlimit(resource.RLIMIT_DATA, (min(allowed, *known) if known else allowed, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_DATA, before)


def copies(most: int) -> int:
    """How many processes like this one, at most so many and at least one, the limit in force leaves room for."""
    allowed, own = _allowed(), held()
    return most if allowed is None or own == 0 else max(1, min(most, (allowed - own) // own))


def reserve(size: float, what: str) -> None:
    """Asks before so many bytes are taken for ``what``, a plural that begins a sentence.

    Raises:
        MemoryError: the limit in force leaves no room for them.
    """
    allowed = _allowed()
    if allowed is not None and size > (room := max(0, allowed - _status("VmData"))):
        raise MemoryError(f"{what} need about {sized(size)}; {sized(room)} are available")


def exhausted(error: Exception) -> bool:
    """Whether an error says that there is no memory; libraries in C++ say so in words of their own."""
    return isinstance(error, MemoryError) or "bad_alloc" in str(error) or "bad allocation" in str(error)


def left(size: int) -> int:
    """How many of ``size`` bytes this process leaves to another one: a quarter of them in any case."""
    return max(size - held(), size // 4)


def sized(size: float) -> str:
    """Bytes in words: ``1.5 GB``, ``300 MB``."""
    return f"{size / (1 << 30):.3g} GB" if size >= 1 << 30 else f"{size / (1 << 20):.3g} MB"


def _allowed() -> int | None:
    """Bytes that this process may take, where there is a limit."""
    if sys.platform != "linux":
        return None
    import resource

    allowed = resource.getrlimit(resource.RLIMIT_DATA)[0]
    return None if allowed == resource.RLIM_INFINITY else allowed


def _status(name: str) -> int:
    """Bytes that the system's table of this process gives under a name; 0 where there is none."""
    try:
        match = re.search(rf"^{name}:\s+(\d+) kB", Path("/proc/self/status").read_text(), re.MULTILINE)
    except OSError:
        return 0
    return int(match[1]) * 1024 if match else 0
