"""The benchmarks of the corpora share one table: verdict, margins, and satisfaction between samples."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]

HEAD = """mission rest
time step 1 s, horizon 4 s
world (0, 0) to (4, 4)
region far = box (2, 0) to (4, 4)
agent cart { radius 0.1 m  dynamics single_integrator(speed <= 1 m/s)  start at (1, 1) }
"""


@pytest.mark.parametrize(
    ("bench", "requirement", "verdict", "between"),
    [
        ("strangers", "eventually[0, 4 s] far", "planned", "yes"),
        ("peers", "eventually[0, 0 s] far", "by check", ""),
    ],
)
def test_a_bench_measures_the_missions_of_a_folder(
    bench: str, requirement: str, verdict: str, between: str, tmp_path: Path
) -> None:
    (tmp_path / "rest.mission").write_text(f"{HEAD}require move: cart: {requirement}\n", encoding="utf-8")
    kept = tmp_path / "rows.json"
    command = [sys.executable, str(ROOT / "bench" / f"{bench}.py"), str(tmp_path), "--json", str(kept)]
    came = subprocess.run(command, capture_output=True, text=True, check=False)
    assert came.returncode == 0, came.stderr
    row = json.loads(kept.read_text(encoding="utf-8"))["rest"]
    assert (row["outcome"], row["between"]) == (verdict, between)
    assert f"| rest | {verdict} |" in came.stdout
