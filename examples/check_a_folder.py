"""Check every mission of a folder, and say in one line each how it is.

python examples/check_a_folder.py missions
"""

from __future__ import annotations

import sys
from pathlib import Path

import missionc


def main(folder: str) -> int:
    results = [missionc.check(path) for path in sorted(Path(folder).glob("*.mission"))]
    for checked in results:
        codes = ", ".join(sorted({finding.code.name for finding in checked.findings}))
        print(f"{Path(checked.file).name:<28} {'ok' if checked.ok else 'wrong':<6} {codes}")
    return 0 if all(checked.ok for checked in results) else 1


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1] if len(sys.argv) > 1 else "missions"))
