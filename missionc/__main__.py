"""Where the process begins: signals first, so that even the imports end well."""

from __future__ import annotations

import io
import sys

from missionc.signals import Stopped, stoppable


def main() -> int:
    """Run the command that ``sys.argv`` gives; returns the exit status."""
    for stream in (sys.stdout, sys.stderr):
        # A letter that the terminal lacks, or a file name in no encoding, must not stop a message.
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
    try:
        with stoppable():
            from missionc.cli import main as run

            return run(sys.argv[1:])
    except Stopped as stopped:
        return stopped.status


if __name__ == "__main__":
    raise SystemExit(main())
