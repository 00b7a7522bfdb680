"""Entry point of the process, which installs signal handlers before any other import.

Imports before that are minimal: until then, the interpreter handles signals in its own way.
"""

from __future__ import annotations

import gc
import signal

OBJECTS = 100_000
"""Number of new objects between two garbage collections; with Python's default, collections take a sixth of a check."""


def main() -> int:
    """Run the command in ``sys.argv``, and return its exit status."""
    # There is nothing to clean up yet, and the system ends a process at once and silently.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    gc.set_threshold(OBJECTS)
    import io
    import sys
    import time
    from contextlib import nullcontext

    began = time.monotonic()

    from missionc.base.supervision import supervise
    from missionc.cli.streams import finished, hold_numbers

    hold_numbers()
    # A server has no deadline of its own; its editor or terminal ends it.
    serves = {"lsp", "studio"} & set(sys.argv[1:2]) or {"--watch", "--live"} & set(sys.argv[1:])
    ended = None if serves else supervise()
    for stream in (sys.stdout, sys.stderr):
        # A character that the terminal lacks, or an undecodable file name, must not stop a message.
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
    if ended is not None:
        if ended.cause is None:
            return ended.status
        from missionc.cli.app import say_ended

        return finished(say_ended(ended, sys.argv[1:]))
    from missionc.base.memory import DEFAULT_LIMIT, limited
    from missionc.base.signals import Stopped, stoppable

    sized = serves or any(word.startswith("--memory-limit") for word in sys.argv)
    try:
        with stoppable(), nullcontext() if sized else limited(DEFAULT_LIMIT):
            from missionc.cli.app import main as run

            return finished(run(sys.argv[1:], began))
    except Stopped as stopped:
        return finished(stopped.status)


def run() -> None:
    """Run the command in ``sys.argv`` and end the process at once with its exit status.

    All output is written and temporary data removed by then. The interpreter's own exit would wait for running threads,
    and take up to a second to free the data of large libraries.
    """
    import os

    os._exit(main())


if __name__ == "__main__":
    run()
