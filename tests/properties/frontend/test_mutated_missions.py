"""Whatever is done to a mission's text, ``check`` answers with findings: no exception, no endless work.

``MISSIONC_FUZZ=200000`` sends so many missions through instead of the usual number; `make fuzz` does.
"""

from __future__ import annotations

import json
import os
import time

import pytest

from missionc.backends.api import Budget
from missionc.base.diagnostics.render import render_json, render_text
from missionc.base.source import Source
from missionc.cli import emit_stages, stage_names
from missionc.compiler import driver
from missionc.compiler.front_end import Checked
from missionc.compiler.plan_request import PlanRequest
from tests.support.mutated_texts import mutated

USUAL = 2_000
PARTS = 4
PROCESSOR_SECONDS = 20.0
"""For one mission: far more than the slowest takes, far less than something that has no end."""
NODES = 30
"""Of a roadmap, where a mission does not say how many: those of agents with momentum take seconds to grow by more."""


def assert_well_formed(checked: Checked) -> None:
    """Every finding can be shown, and points into the text; a mission without errors can be printed stage by stage."""
    findings = list(checked.findings)
    json.dumps(render_json(findings), allow_nan=False)
    assert render_text(findings, colour=False).count("[MC") >= len(findings)
    for finding in findings:
        assert finding.code.name != "MC901"
        assert finding.message
        for label in filter(None, (finding.primary, *finding.labels)):
            assert 0 <= label.span.start <= label.span.end <= len(label.span.source.text)
    if checked.ok:
        printed = emit_stages.of_checked(checked, stage_names.BEFORE_PLANNING, PlanRequest(Budget(0.0)))
        assert [name for name, _ in printed] == list(stage_names.BEFORE_PLANNING)
    else:
        assert findings


@pytest.mark.parametrize("part", range(PARTS))
def test_mutated_missions_are_checked_without_exception_in_bounded_time(
    part: int,
) -> None:
    for seed in range(part, int(os.environ.get("MISSIONC_FUZZ", USUAL)), PARTS):
        text = mutated(seed)
        begin = time.process_time()
        try:
            checked = driver.check(Source("fuzz.mission", text), overrides={"smt.nodes": str(NODES)})
        except Exception as error:
            raise AssertionError(f"seed {seed}: {error!r}\n{text}") from error
        assert time.process_time() - begin < PROCESSOR_SECONDS, f"seed {seed}\n{text}"
        assert_well_formed(checked)
