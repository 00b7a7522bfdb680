"""What is given out: every package that users install has a hash, and the same tree builds the same bytes."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tarfile
from hashlib import sha256
from pathlib import Path

import pytest

pytest.importorskip("packaging")

from packaging.utils import canonicalize_name

from tests.unit.project.test_constraints import CONSTRAINTS, needed

ROOT = Path(__file__).resolve().parents[3]
LOCK = ROOT / "requirements.lock"
USERS = ("cluster", "export", "graph", "grammar", "lsp", "maps", "sat", "studio", "sweep", "viz")
"""The extras for users, but for those that need torch or fly."""
GIVEN_OUT = (
    *("missionc", "grammars", "missions", "examples", "docs", "tests", "bench", "editors", "website"),
    *("pyproject.toml", "Makefile", "README.md", "LICENSE", "SECURITY.md", "constraints.txt", "requirements.lock"),
)


def pinned(text: str) -> dict[str, str]:
    """The version of each package, by canonical name."""
    found = re.findall(r"^([\w.-]+)==([\w.]+)", text, re.MULTILINE)
    return {canonicalize_name(name): version for name, version in found}


def test_the_lock_has_what_the_extras_for_users_bring_in_the_versions_of_the_constraints() -> None:
    locked, constrained = pinned(LOCK.read_text()), pinned(CONSTRAINTS.read_text())
    assert locked == {name: constrained[name] for name in needed("missionc", *USERS) if name != "missionc"}
    assert f"USERS := {','.join(USERS)}\n" in (ROOT / "Makefile").read_text()


def test_every_package_of_the_lock_has_a_hash_and_none_says_where_it_is_from() -> None:
    text = LOCK.read_text()
    assert "://" not in text
    for entry in text.replace(" \\\n", " ").splitlines():
        name, *hashes = entry.split()
        assert hashes, name
        assert all(re.fullmatch(r"--hash=sha256:[0-9a-f]{64}", each) for each in hashes), name


def built(tree: Path) -> dict[str, str]:
    """The hashes of what a tree builds."""
    command = [sys.executable, "-m", "hatchling", "build", "-d", str(tree / "dist")]
    environment = {**os.environ, "SOURCE_DATE_EPOCH": "1580601600"}
    subprocess.run(command, cwd=tree, env=environment, check=True, capture_output=True)
    return {path.name: sha256(path.read_bytes()).hexdigest() for path in (tree / "dist").iterdir()}


def checkout(folder: Path) -> Path:
    """A copy of what is given out, without what was built in it."""
    folder.mkdir()
    for name in GIVEN_OUT:
        if (ROOT / name).is_dir():
            shutil.copytree(ROOT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__", "node_modules"))
        else:
            shutil.copy(ROOT / name, folder / name)
    return folder


@pytest.mark.slow
def test_trees_of_different_dates_build_the_same_bytes_and_so_does_what_they_give_out(tmp_path: Path) -> None:
    pytest.importorskip("hatchling", reason="the extra `release` builds what is given out")
    one, other = checkout(tmp_path / "one"), checkout(tmp_path / "other")
    for path in other.rglob("*"):
        os.utime(path, (978_307_200, 978_307_200))
    modules = other / "editors" / "vscode" / "node_modules"
    modules.mkdir()
    (modules / "fetched.js").write_text("// by npm")
    hashes = built(one)
    assert hashes == built(other)
    assert len(hashes) == 2
    with tarfile.open(next((one / "dist").glob("*.tar.gz"))) as archive:
        archive.extractall(tmp_path / "sources", filter="data")
    (sources,) = (tmp_path / "sources").iterdir()
    wheel = next(name for name in hashes if name.endswith(".whl"))
    assert built(sources)[wheel] == hashes[wheel]


@pytest.mark.slow
def test_the_wheel_runs_outside_of_the_tree(tmp_path: Path) -> None:
    pytest.importorskip("hatchling", reason="the extra `release` builds what is given out")
    tree = checkout(tmp_path / "tree")
    built(tree)
    (wheel,) = (tree / "dist").glob("*.whl")
    install = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--target", str(tmp_path / "there")]
    subprocess.run([*install, str(wheel)], check=True, capture_output=True)
    shutil.copy(ROOT / "missions" / "wildfire.mission", tmp_path)
    shutil.rmtree(tree)
    script = (
        "import sys, missionc\nfrom missionc.cli.app import main\n"
        "print(missionc.__file__, flush=True)\nsys.exit(main(sys.argv[1:]))"
    )
    for words in (["check", "wildfire.mission"], ["init", "--list"], ["explain", "MC301"]):
        ran = subprocess.run(
            [sys.executable, "-c", script, *words],
            cwd=tmp_path,
            env={**os.environ, "PYTHONPATH": str(tmp_path / "there")},
            capture_output=True,
            text=True,
        )
        assert ran.returncode == 0, ran.stderr
        assert ran.stdout.startswith(str(tmp_path / "there"))
