"""Memory of this process: its current size, and an upper limit.

Only Linux supports both; on other systems the size is 0, and there is no limit.
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
"""Minimum number of bytes that any limit leaves to a process; less would not suffice for an error message."""


def held() -> int:
    """Resident memory of this process, bytes."""
    return _status("RssAnon")


@contextmanager
def limited(size: int) -> Iterator[None]:
    """Context in which allocations beyond a total of about ``size`` bytes raise a ``MemoryError``.

    Memory that is already allocated counts, but at least half of ``size`` remains available.
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
    """Number of processes of this process's size, from 1 to ``most``, that fit into the current memory limit."""
    allowed, own = _allowed(), held()
    return most if allowed is None or own == 0 else max(1, min(most, (allowed - own) // own))


def reserve(size: float, what: str) -> None:
    """Check that ``size`` bytes for ``what`` fit into the current memory limit.

    Args:
        what: purpose of the memory, a plural noun that begins the sentence of the error.

    Raises:
        MemoryError: the request exceeds the current limit.
    """
    allowed = _allowed()
    if allowed is not None and size > (room := max(0, allowed - _status("VmData"))):
        raise MemoryError(f"{what} need about {sized(size)}; {sized(room)} are available")


def exhausted(error: BaseException) -> bool:
    """Return true if an error reports that memory is exhausted, in Python or in a C++ library."""
    return isinstance(error, MemoryError) or "bad_alloc" in str(error) or "bad allocation" in str(error)


def left(size: int) -> int:
    """Part of ``size`` bytes that this process leaves to another process, at least a quarter; bytes."""
    return max(size - held(), size // 4)


def sized(size: float) -> str:
    """Number of bytes as text: ``1.5 GB``, ``300 MB``."""
    return f"{size / (1 << 30):.3g} GB" if size >= 1 << 30 else f"{size / (1 << 20):.3g} MB"


def _allowed() -> int | None:
    """Memory limit of this process, bytes; None without a limit."""
    if sys.platform != "linux":
        return None
    import resource

    allowed = resource.getrlimit(resource.RLIMIT_DATA)[0]
    return None if allowed == resource.RLIM_INFINITY else allowed


def _status(name: str) -> int:
    """Value of a field of ``/proc/self/status``, bytes; 0 if the field does not exist."""
    try:
        match = re.search(rf"^{name}:\s+(\d+) kB", Path("/proc/self/status").read_text(), re.MULTILINE)
    except OSError:
        return 0
    return int(match[1]) * 1024 if match else 0
