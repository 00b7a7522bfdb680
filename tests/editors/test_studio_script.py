"""The script of the studio's page is what its sources make, with the licences of all that is in it."""

from __future__ import annotations

import hashlib
import re
import shutil
import subprocess
from pathlib import Path

import pytest

from tests.support.npm import ROOT, fetch, npm

FOLDER = ROOT / "editors" / "studio"
ASSETS = ROOT / "missionc" / "tools" / "studio" / "assets"


def digest() -> str:
    """Of what the script is built from, as ``build.js`` works it out."""
    sources = sorted(f"src/{path.name}" for path in (FOLDER / "src").iterdir())
    found = hashlib.sha256()
    for name in ("build.js", "package-lock.json", *sources):
        found.update(f"{name}\n".encode() + (FOLDER / name).read_bytes())
    return found.hexdigest()


def test_the_script_was_built_from_the_sources_that_are_here() -> None:
    assert (ASSETS / "SOURCES.sha256").read_text() == f"{digest()}\n", "run `make studio`"


def test_the_lock_file_names_no_host() -> None:
    assert "resolved" not in (FOLDER / "package-lock.json").read_text(encoding="utf-8")


def test_each_package_that_is_in_the_script_has_its_licence_beside_it() -> None:
    licences = (ASSETS / "LICENSES.txt").read_text(encoding="utf-8")
    named = re.findall(r"^(\S+) \d+\.\d+\.\d+ \((\S+)\)\n\n", licences, re.MULTILINE)
    assert {"@codemirror/view", "@codemirror/lsp-client", "marked"} <= {name for name, _ in named}
    assert {licence for _, licence in named} == {"MIT"}
    assert licences.count("Permission is hereby granted") >= len(named)


def test_the_page_names_nothing_that_is_not_beside_it() -> None:
    page = (ASSETS / "index.html").read_text(encoding="utf-8")
    assert set(re.findall(r'(?:src|href)="([^"]+)"', page)) <= {path.name for path in ASSETS.iterdir()}
    assert "http" not in page + (ASSETS / "studio.css").read_text(encoding="utf-8")


@pytest.mark.node
def test_drags_come_out_as_an_author_would_write_them() -> None:
    run = npm(FOLDER, "test")
    assert run.returncode == 0, run.stdout


@pytest.mark.node
@pytest.mark.slow
def test_the_sources_build_the_script_that_is_here(tmp_path: Path) -> None:
    folder = shutil.copytree(FOLDER, tmp_path / "editors" / "studio", ignore=shutil.ignore_patterns("node_modules"))
    built = tmp_path / "missionc" / "tools" / "studio" / "assets"
    built.mkdir(parents=True)
    fetch(folder, "ci")
    node = shutil.which("node")
    assert node
    subprocess.run([node, "build.js"], cwd=folder, check=True)
    for name in ("studio.js", "LICENSES.txt", "SOURCES.sha256"):
        assert (built / name).read_bytes() == (ASSETS / name).read_bytes()
