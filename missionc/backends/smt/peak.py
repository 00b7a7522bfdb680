"""The most memory a process has held."""

from __future__ import annotations

import re
from pathlib import Path


def peak_bytes(process: int) -> int:
    """Of a process that still runs; 0 where the system does not say."""
    try:
        status = Path(f"/proc/{process}/status").read_text()
    except OSError:
        return 0
    found = re.search(r"VmHWM:\s+(\d+) kB", status)
    return int(found[1]) * 1024 if found else 0
