"""Benchmark of possible and impossible missions: answer, its source, and time for each.

    python bench/both_sides.py [--only NAME …] [--time-limit 20] [--minimize duration] [--json FILE] [--against FILE]
        [FILE …]

Each mission of `missions/both_sides`, or each FILE, is compiled unchanged, one after the other, in a separate process
and without explanations of infeasibility. The name is the label: no motion of the agents satisfies a mission whose name
begins with ``impossible``, for the reason in its first lines; all others have a plan. The answers:

- *planned*: there is a plan, and it is verified.
- *impossible*: no motion of the agents satisfies the mission, on any roadmap.
- *on roadmaps*: the tried roadmaps contain no plan, which proves nothing about the mission.
- *by check*: `missionc check` reports an error.
- *undecided*: none of these within the time limit.

*Side* is the source of the answer: the backend of a plan, ``roadmaps``, ``proof`` or ``check``. Processor seconds are
those of the process and its children. *Gap*, for missions with an objective, is the plan's value minus the proven lower
bound, in steps or metres, as in `plan.json`. ``--minimize duration`` sets this objective in missions that have none.

*Cover* is the result of covers for the mission alone: *refused*, *admitted*, or empty if undecided; with its processor
seconds.

A planned impossible mission, and a possible one that is called impossible or rejected by check or by a cover, are
defects of the compiler or of the label: the program then ends with status 1.

``--json`` writes the measurements. ``--against`` reads such a file, and adds columns: the earlier answer, and the ratio
of processor seconds to the earlier ones.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import shutil
import statistics
import sys
import tempfile
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from field import figure, ratio, run, verdict
from response_time import ROOT

from missionc.backends.api import Budget
from missionc.backends.cover.refute import Inconclusive, Refuted
from missionc.backends.options import Options
from missionc.base.limits import Limits
from missionc.compiler import driver
from missionc.compiler.ask_cover import CoverSide
from missionc.compiler.strategy import COVERS
from missionc.ir.kernel.nodes import Kernel
from missionc.ir.lower.unroll_past import looking_ahead

MISSIONS = ROOT / "missions" / "both_sides"


@dataclass(frozen=True, slots=True)
class Row:
    """Result of one mission; ``gap`` in steps or metres, as in ``unit``, None without an objective."""

    possible: bool
    answer: str
    side: str
    processor: float
    gap: float | None = None
    unit: str = ""
    cover: str = ""
    cover_processor: float = 0.0

    @property
    def planned(self) -> bool:
        return self.answer == "planned"

    @property
    def ruled_out(self) -> bool:
        """True if the answer is a fact about the mission: nothing satisfies it."""
        return self.answer in ("impossible", "by check")

    @property
    def wrong(self) -> bool:
        """True if the answer contradicts the label."""
        return self.ruled_out or self.cover == "refused" if self.possible else self.planned


def answer(document: dict[str, Any]) -> tuple[str, str]:
    """Answer in a JSON document, and its source."""
    found = verdict(document)
    sides = {
        "planned": str(document["backend"]),
        "by check": "check",
        "on roadmaps": "roadmaps",
        "impossible": "proof",
    }
    return found, sides.get(found, "")


def measured(path: Path, limit: float) -> Row:
    """Plan a mission, and compare its plan with the proven lower bound."""
    possible = not path.stem.startswith("impossible")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name) / "plan"
        came = run(path, limit, folder)
        row = Row(possible, *answer(came.document), came.processor)
        if row.answer != "by check":
            row = with_cover(row, path, limit)
        if not row.planned:
            return row
        plan = json.loads((folder / "plan.json").read_text(encoding="utf-8"))
    match plan:
        case {"proven": {"value": value, "least": least, "unit": "s"}, "step": step}:
            return replace(row, gap=round((value - least) / step, 6), unit="steps")
        case {"proven": {"value": value, "least": least, "unit": unit}}:
            return replace(row, gap=value - least, unit=unit)
        case _:
            return row


@contextmanager
def asked(path: Path, objective: str) -> Iterator[Path]:
    """Mission file, with an objective added in a separate folder if one is requested and missing."""
    text = path.read_text(encoding="utf-8")
    if not objective or re.search(r"^minimize\b", text, re.MULTILINE):
        yield path
        return
    with tempfile.TemporaryDirectory() as name:
        for each in path.parent.iterdir():
            if each.is_file():
                shutil.copy(each, name)
        own = Path(name) / path.name
        own.write_text(f"{text}\nminimize {objective}\n", encoding="utf-8")
        yield own


def with_cover(row: Row, path: Path, limit: float) -> Row:
    """Row with the result of covers alone."""
    checked = driver.check(path)
    assert checked.mission is not None
    assert checked.kernel is not None
    kernel = looking_ahead(checked.mission, checked.kernel, Limits().formula_nodes)
    assert isinstance(kernel, Kernel)
    side = CoverSide(checked.mission, kernel, checked.kernel, Options(), Budget(time.monotonic() + limit / COVERS.time))
    begin = processor()
    side.refusal(COVERS.failed)
    words = {Refuted: "refused", Inconclusive: "admitted"}
    return replace(row, cover=words.get(type(side.answer), ""), cover_processor=processor() - begin)


def processor() -> float:
    """Processor seconds so far of this process and its finished children."""
    return sum(os.times()[:4])


def line(name: str, row: Row, before: Row | None, compares: bool) -> str:
    label = "possible" if row.possible else "impossible"
    gap = "–" if row.gap is None else f"{row.gap:.3g} {row.unit}"
    cells = [name, label, row.answer + (" (wrong)" if row.wrong else ""), row.side, f"{row.processor:.1f}", gap]
    cells += [row.cover or "–", f"{row.cover_processor:.1f}" if row.cover else "–"]
    if compares:
        cells += [before.answer if before else "–"]
        cells += [figure(ratio(row.processor, before.processor if before else None), ".2f")]
    return f"| {' | '.join(cells)} |"


def summary(rows: Iterable[Row]) -> Iterator[str]:
    """Number of answers for each label, with times and gaps."""
    every = list(rows)
    for label, ours in (
        ("impossible", [row for row in every if not row.possible]),
        ("possible", [row for row in every if row.possible]),
    ):
        if ours:
            answers = sorted({row.answer for row in ours}, key=lambda word: -sum(row.answer == word for row in ours))
            counts = ", ".join(f"{sum(row.answer == word for row in ours)} {word}" for word in answers)
            spent = [row.processor for row in ours]
            yield f"{len(ours)} {label}: {counts}; median {statistics.median(spent):.1f} s, most {max(spent):.1f} s"
    cannot = [row for row in every if not row.possible]
    covers = [row.cover_processor for row in every if row.cover == "refused"]
    if covers:
        yield f"refused by covers: {len(covers)}; median {statistics.median(covers):.2f} s, most {max(covers):.1f} s"
    yield f"impossible missions with a proof: {sum(row.ruled_out for row in cannot)} of {len(cannot)}"
    yield f"wrong refusals of the possible: {sum(row.wrong for row in every if row.possible)}"
    yield f"plans of the impossible: {sum(row.wrong for row in cannot)}"
    yield f"seconds of the processor: median {statistics.median(row.processor for row in every):.2f}"
    for unit in ("steps", "m"):
        gaps = [row.gap for row in every if row.unit == unit and row.gap is not None]
        if gaps:
            yield f"optimality gap of {len(gaps)} plans: median {statistics.median(gaps):.3g} {unit}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "files", nargs="*", type=Path, metavar="FILE", help="missions to use instead of missions/both_sides"
    )
    parser.add_argument(
        "--only", nargs="*", metavar="NAME", help="only missions whose names contain one of these words"
    )
    parser.add_argument(
        "--time-limit", type=float, default=20.0, help="time limit of each mission, in seconds of wall time"
    )
    parser.add_argument(
        "--minimize", choices=["duration", "distance"], default="", help="objective for missions without one"
    )
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the results to a file")
    parser.add_argument("--against", type=Path, metavar="FILE", help="compare with the results in this file")
    arguments = parser.parse_args()
    kept = json.loads(arguments.against.read_text(encoding="utf-8")) if arguments.against else {}
    before = {name: Row(**row) for name, row in kept.items()}
    paths = arguments.files or sorted(MISSIONS.glob("*.mission"))
    if arguments.only is not None:
        paths = [path for path in paths if any(word in path.stem for word in arguments.only)]
    if not paths:
        parser.error("no mission is called that")
    heads = [
        "mission",
        "label",
        "answer",
        "side",
        "CPU s",
        "gap",
        "cover",
        "cover s",
        *(["before", "CPU ratio"] if before else []),
    ]
    print(f"| {' | '.join(heads)} |\n|{'---|' * len(heads)}", flush=True)
    rows: dict[str, Row] = {}
    for path in paths:
        with asked(path, arguments.minimize) as mission:
            row = rows[path.stem] = measured(mission, arguments.time_limit)
        print(line(path.stem, row, before.get(path.stem), bool(before)), flush=True)
        if arguments.json:
            text = json.dumps({name: asdict(each) for name, each in rows.items()}, indent=1)
            arguments.json.write_text(text + "\n", encoding="utf-8")
    print("\n" + "\n".join(summary(rows.values())))
    sys.exit(any(row.wrong for row in rows.values()))


if __name__ == "__main__":
    main()
