"""What is to be written to a process: a thread writes it, so that a busy process keeps nobody waiting."""

from __future__ import annotations

import queue
import threading
from typing import IO


class Outbox:
    """Writes to a pipe that nobody else writes to, in the order it is given; what a dead process misses is dropped."""

    def __init__(self, pipe: IO[bytes]) -> None:
        self._pipe = pipe
        self._waiting: queue.SimpleQueue[bytes | None] = queue.SimpleQueue()
        self._thread = threading.Thread(target=self._pump, daemon=True)
        self._thread.start()

    def put(self, message: bytes) -> None:
        self._waiting.put(message)

    def end(self) -> None:
        """Nothing more will come: the pipe is closed when all is written."""
        self._waiting.put(None)

    def _pump(self) -> None:
        try:
            with self._pipe:
                while (waiting := self._waiting.get()) is not None:
                    left = memoryview(waiting)
                    while left:
                        left = left[self._pipe.write(left) :]
        except (OSError, ValueError):  # the process is gone
            return
