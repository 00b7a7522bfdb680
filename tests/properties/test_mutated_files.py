"""Whatever is done to a file that a mission reads, `check` answers with findings in words of the file alone.

``MISSIONC_FUZZ=20000`` sends so many files through instead of the usual number.
"""

from __future__ import annotations

import json
import os
import re
import warnings
from pathlib import Path

import pytest

pytest.importorskip("PIL")
pytest.importorskip("yaml")

from missionc.diagnostics.render import render_json, render_text
from missionc.pipeline.driver import check
from tests.support.mapped_missions import written
from tests.support.mutated_files import FILES, SAID, mutated_files

USUAL = 100
OF_PYTHON = re.compile(
    r"Node\(|tag:yaml|object at 0x|NoneType|\bNone\b|\bTrue\b|\bFalse\b|indices|Error\b|Traceback|<class"
)
"""What a message never says: values and errors as Python writes them."""


def test_the_files_as_they_are_earn_no_error(tmp_path: Path) -> None:
    assert check(written(tmp_path, SAID, FILES)).ok


def test_mutated_files_are_read_or_refused_in_their_own_words(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    read = 0
    for seed in range(int(os.environ.get("MISSIONC_FUZZ", USUAL))):
        files = mutated_files(seed)
        with warnings.catch_warnings(record=True) as warned:
            warnings.simplefilter("always")
            try:
                checked = check(written(tmp_path, SAID, files))
            except Exception as error:
                raise AssertionError(f"seed {seed}: {error!r}") from error
        assert not warned, f"seed {seed}: {warned[0]}"
        findings = list(checked.findings)
        assert render_text(findings, colour=False).count("[MC") >= len(findings)
        json.dumps(render_json(findings), allow_nan=False)
        for finding in findings:
            said = re.sub(r"`[^`]*`", "``", finding.words)
            assert not OF_PYTHON.search(said), f"seed {seed}: {finding.words}"
            for label in filter(None, (finding.primary, *finding.labels)):
                assert 0 <= label.span.start <= label.span.end <= len(label.span.source.text), f"seed {seed}: {finding}"
        read += checked.ok
    assert capfd.readouterr().err == ""
    assert read > 0
