"""npm for tests that carry the mark `node`; where it has no way to a registry they are skipped."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
UNREACHABLE = ("ENOTFOUND", "EAI_AGAIN", "ECONNREFUSED", "ECONNRESET", "ETIMEDOUT", "ENETUNREACH")
"""What npm says where there is no way to a registry."""


def npm(folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    """What npm has to say, run in a folder."""
    program = shutil.which("npm")
    assert program
    environment = os.environ | {"PYTHON": sys.executable, "MISSIONC_ROOT": str(ROOT)}
    return subprocess.run([program, *words], cwd=folder, env=environment, capture_output=True, text=True)


def fetch(folder: Path, *words: str) -> str:
    """What an npm command that fetches packages writes to standard output."""
    fetched = npm(folder, *words)
    if fetched.returncode and any(f"code {word}" in fetched.stderr for word in UNREACHABLE):
        pytest.skip("npm has no way to a registry")
    assert fetched.returncode == 0, fetched.stderr
    return fetched.stdout
