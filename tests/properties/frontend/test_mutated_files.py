"""Whatever is done to a file that a mission reads, `check` answers with findings in words of the file alone.

``MISSIONC_FUZZ=20000`` sends so many files through instead of the usual number; the farm goes on with others.
"""

from __future__ import annotations

import os
import warnings
from pathlib import Path

import pytest

pytest.importorskip("PIL")
pytest.importorskip("yaml")

from missionc.compiler.driver import check
from tests.support.mapped_missions import written
from tests.support.mutated_files import FILES, SAID, faults, mutated_files

USUAL = 100


def test_the_files_as_they_are_earn_no_error(tmp_path: Path) -> None:
    assert check(written(tmp_path, SAID, FILES)).ok


def test_mutated_files_are_read_or_refused_in_their_own_words(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    read = 0
    for seed in range(int(os.environ.get("MISSIONC_FUZZ", USUAL))):
        with warnings.catch_warnings(record=True) as warned:
            warnings.simplefilter("always")
            try:
                checked = check(written(tmp_path, SAID, mutated_files(seed)))
            except Exception as error:
                raise AssertionError(f"seed {seed}: {error!r}") from error
        assert not warned, f"seed {seed}: {warned[0]}"
        assert list(faults(checked)) == [], f"seed {seed}"
        read += checked.ok
    assert capfd.readouterr().err == ""
    assert read > 0
