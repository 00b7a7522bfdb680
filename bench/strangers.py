"""Benchmark of missions that were written from the documentation, by people who had not seen the planners.

    python bench/strangers.py [DIR] [--only NAME …] [--time-limit 120] [--json FILE] [--against FILE]

The missions are those of `missions/strangers`, or of ``DIR``. Each begins with what a person would do, so that a plan
exists. The table and the flags are those of `bench/field.py`.
"""

from __future__ import annotations

from field import benchmark
from response_time import ROOT

if __name__ == "__main__":
    benchmark(__doc__ or "", ROOT / "missions" / "strangers")
