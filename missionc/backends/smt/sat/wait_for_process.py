"""Waiting for processes: until one of them answers, or until it is time to end."""

from __future__ import annotations

import select
import time
from collections.abc import Sequence
from typing import Protocol, TypeVar

from missionc.base.signals import stop_requested


class HasFileno(Protocol):
    def fileno(self) -> int: ...


Stream = TypeVar("Stream", bound=HasFileno)


def wait(streams: Sequence[Stream], deadline: float) -> list[Stream]:
    """The streams that have something to say; none once time is up, or someone has asked to end.

    Args:
        deadline: on the clock of ``time.monotonic``.
    """
    patience = 0.1  # seconds between two checks for a signal
    while not is_over(deadline):
        left = max(0.0, deadline - time.monotonic())
        ready = select.select(streams, [], [], min(left, patience))[0]
        if ready:
            return ready
    return []


def is_over(deadline: float) -> bool:
    """Whether time is up, or someone has asked to end."""
    return stop_requested() or time.monotonic() >= deadline
