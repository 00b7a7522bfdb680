"""npm for tests with the mark `node`; they are skipped without access to a registry."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
UNREACHABLE = ("ENOTFOUND", "EAI_AGAIN", "ECONNREFUSED", "ECONNRESET", "ETIMEDOUT", "ENETUNREACH")
"""Messages of npm without access to a registry."""


def npm(folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    """Result of npm, run in a folder."""
    program = shutil.which("npm")
    assert program
    environment = os.environ | {"PYTHON": sys.executable, "MISSIONC_ROOT": str(ROOT)}
    return subprocess.run([program, *words], cwd=folder, env=environment, capture_output=True, text=True)


def fetch(folder: Path, *words: str) -> str:
    """Output of an npm command that fetches packages."""
    fetched = npm(folder, *words)
    if fetched.returncode and any(f"code {word}" in fetched.stderr for word in UNREACHABLE):
        pytest.skip("npm has no way to a registry")
    assert fetched.returncode == 0, fetched.stderr
    return fetched.stdout
