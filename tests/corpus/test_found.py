"""What the farm has found is found no longer: every file in `tests/corpus/found` is taken through its trial again."""

from __future__ import annotations

from pathlib import Path

import pytest

from farm import found_files
from farm.__main__ import load
from farm.journal import Journal
from farm.look import look
from farm.own_process import carried_out
from farm.trials import KINDS

MINUTES = 10
LONG = ("killed_processes_sweep_leaves_for_good_1",)
"""Those that take longer than a few seconds."""


@pytest.mark.parametrize(
    "path",
    [
        pytest.param(path, marks=pytest.mark.slow) if path.stem in LONG else path
        for path in found_files.kept_in(found_files.FOUND)
    ],
    ids=lambda path: path.name,
)
def test_what_was_found_holds(path: Path) -> None:
    found = found_files.read(path)
    answer = carried_out(KINDS[found.kind], found.case)
    assert answer.fault is None, f"{found.promise}\n{answer.fault.signature}\n{answer.fault.seen}"


@pytest.mark.slow
@pytest.mark.timeout(0)
def test_the_farm_finds_nothing_in_ten_minutes(tmp_path: Path) -> None:
    load()
    journal, lines = Journal(tmp_path / "farm"), list[str]()
    found = look(journal, 0, 60.0 * MINUTES, tmp_path / "found", "", lines.append)
    seen = "\n".join(f"{each.path.read_text()}\n{each.fault.seen}" for each in found)
    assert found == [], "\n".join([*lines, seen])
