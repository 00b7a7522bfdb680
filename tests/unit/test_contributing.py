"""The worked example of CONTRIBUTING is a change that still applies."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.skipif(shutil.which("git") is None, reason="git applies the change")
def test_the_operator_of_contributing_still_applies(tmp_path: Path) -> None:
    diff = re.search(r"```diff\n(.*?)```", (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8"), re.DOTALL)
    assert diff
    edited = re.findall(r"^--- a/(.+)$", diff[1], re.MULTILINE)
    for name in edited:
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / name, tmp_path / name)
    apply = ["git", "apply", "--unidiff-zero", "-"]
    run = subprocess.run(apply, cwd=tmp_path, input=diff[1], capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    assert len(edited) == 4
    compile((tmp_path / "missionc/language/operators/unless.py").read_text(), "unless.py", "exec")
