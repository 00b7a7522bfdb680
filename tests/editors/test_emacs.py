"""The settings for Emacs that the documentation gives, in an Emacs that finds them in its own."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.golden_pages import blocks

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "editors.md").read_text(encoding="utf-8")

SHOW = """
(package-initialize)
(require 'eglot)
(require 'flymake)
(load "{settings}")
(find-file "{mission}")
(unless (eglot-managed-p) (setq eglot-sync-connect t) (apply #'eglot (eglot--guess-contact)))
(let ((rounds 0))
  (while (and (< rounds 300) (null (flymake-diagnostics)))
    (setq rounds (1+ rounds))
    (flymake-start)
    (accept-process-output nil 0.1)))
(dolist (found (flymake-diagnostics))
  (princ (format "%s %d: %s" major-mode (line-number-at-pos (flymake-diagnostic-beg found))
                 (flymake-diagnostic-text found))))
"""
"""Opens a mission as somebody would, and says what is shown to be wrong with it."""


@pytest.mark.skipif(not shutil.which("emacs"), reason="there is no Emacs")
def test_emacs_shows_what_is_wrong(tmp_path: Path) -> None:
    (settings,) = (block.body for block in blocks(PAGE) if block.info == "lisp")
    (tmp_path / "init.el").write_text(settings, encoding="utf-8")
    mission = tmp_path / "wildfire.mission"
    written = (ROOT / "missions" / "wildfire.mission").read_text(encoding="utf-8")
    mission.write_text(written.replace("not fire", "nott fire"), encoding="utf-8")
    script = tmp_path / "show.el"
    script.write_text(SHOW.format(settings=tmp_path / "init.el", mission=mission), encoding="utf-8")
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    ran = subprocess.run(
        ["emacs", "--batch", "-l", str(script)],
        env={**os.environ, "PATH": path, "HOME": str(tmp_path), "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    if "Cannot open load file" in ran.stderr and "eglot" in ran.stderr:
        pytest.skip("this Emacs has no eglot")
    line = written[: written.index("not fire")].count("\n") + 1
    assert f"mission-mode {line}: missionc [MC008]: unknown operator `nott`" in ran.stdout, ran.stderr
