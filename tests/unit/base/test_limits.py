"""The limits of the documentation are those of the compiler."""

from __future__ import annotations

import re
from dataclasses import asdict
from pathlib import Path

from missionc.base.limits import Limits

ROOT = Path(__file__).resolve().parents[3]


def test_the_language_reference_gives_every_limit_with_its_value() -> None:
    page = (ROOT / "docs" / "language.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| `(\w+)` \| ([\d e]+) \|", page[page.index("## Sizes") :], re.MULTILINE)
    assert {name: float(value.replace(" ", "")) for name, value in rows} == asdict(Limits())
