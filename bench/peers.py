"""Benchmark of the scenarios of other planners, beside the greatest robustness of stlpy's formulas in HiGHS.

    python bench/peers.py [DIR] [--only NAME …] [--time-limit 120] [--json FILE] [--against FILE]

The missions are those of `missions/peers`, or of ``DIR``; each names its source, and what is different. The table and
the flags are those of `bench/field.py`.

*stlpy ρ m* is the greatest robustness at the samples that HiGHS finds for the formula tree of stlpy, obstacles
included, in at most a minute: ``≥`` if the minute ended first, and a dash without a linear form, or without stlpy,
which the extra `rivals` installs. *stlpy s* are the solver's seconds of the processor.

Source:
    V. Kurtz and H. Lin, Mixed-integer programming for STL with fewer binary variables (2022): stlpy.
    D. Sun, J. Chen, S. Mitra and C. Fan, Multi-agent motion planning from STL specifications (2022): sun.
    J. Eappen, Z. Xiong, D. Patel, A. Bera and S. Jagannathan, Scaling safe multi-agent control for STL
    specifications (2024): mastl.
    A. Moldagalieva, J. Ortiz-Haro, M. Toussaint and W. Hönig, db-CBS (2024): db.
"""

from __future__ import annotations

from functools import cache
from importlib.util import find_spec
from pathlib import Path

from field import benchmark
from response_time import ROOT

from missionc.compiler import driver

LIMIT = 60.0
"""Seconds of the solver for each mission."""


@cache
def cells(path: Path) -> tuple[str, str]:
    """Greatest robustness in metres, and seconds of the processor."""
    if find_spec("stlpy") is None:
        return "–", "–"
    from table1.most_robust import most_robust
    from table1.scene import Unsupported

    checked = driver.check(path)
    assert checked.mission is not None
    assert checked.kernel is not None
    try:
        best = most_robust(checked.mission, checked.kernel, LIMIT)
    except Unsupported:
        return "–", "–"
    if best.robustness is None:
        return "infeasible" if best.proven else "none in time", f"{best.seconds:.1f}"
    return f"{'' if best.proven else '≥ '}{best.robustness:.3f}", f"{best.seconds:.1f}"


if __name__ == "__main__":
    columns = {"stlpy ρ m": lambda path: cells(path)[0], "stlpy s": lambda path: cells(path)[1]}
    benchmark(__doc__ or "", ROOT / "missions" / "peers", columns)
