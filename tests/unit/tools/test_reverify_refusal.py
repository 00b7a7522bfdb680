"""A folder with a proof that there is no plan is judged from its files alone, as one with a plan is."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path

import pytest

from tests.support.golden_pages import run

pytest.importorskip("pysat")

APART = """\
mission apart
param FAR = 3 m
time  step 1 s, horizon 12 s
world (0, 0) to (9, 4)
region base = box (0.2, 1) to (2, 3)
region goal = box (FAR, 1) to (8.8, 3)
team drone[2] { radius 0.1 m  dynamics single_integrator(speed <= 1 m/s)  start in base }
require stay: drone[0]: always[0, 12 s] base
require close: always[0, 12 s] distance(drone[0], drone[1]) <= 2 m
require visit: drone[1]: eventually[0, 12 s] goal
"""

LATE = """mission late
time  step 1 s, horizon 4 s
world (0, 0) to (8, 2)
region goal = box (5, 0) to (6, 2)
team cart[1] { radius 0.1 m  dynamics single_integrator(speed <= 1 m/s)  start at (1, 1) }
require go: some cart: eventually[0, 4 s] goal
solve with smt
"""


ROADMAPS = """\
mission short_hops
time  step 1 s, horizon 3 s
world (0, 0) to (10, 4)
region base = box (0.2, 0.2) to (1.8, 3.8)
region goal = box (7.5, 0.2) to (9.8, 3.8)
team drone[1] { radius 0.1 m  dynamics single_integrator(speed <= 3 m/s)  start at (1, 2) }
require visit: eventually[0, 3 s] drone[0]: goal
solve with smt { nodes = 12, neighbors = 2 }
"""
"""Refused on coarse roadmaps alone: three long moves lead there."""


def test_a_folder_with_a_proof_has_no_near_miss_and_passes(tmp_path: Path) -> None:
    (tmp_path / "late.mission").write_text(LATE)
    words = ["compile", str(tmp_path / "late.mission"), "--explain-limit", "300", "--certify"]
    status, said = run([*words, "-o", str(tmp_path / "proof")])
    assert status == 4
    assert "closest infeasible candidate" in said
    assert not (tmp_path / "proof" / "near_miss.json").exists()
    assert run(["verify", str(tmp_path / "proof")])[0] == 0


@pytest.fixture(scope="module")
def proved(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """The files of a folder with a proof, by name."""
    folder = tmp_path_factory.mktemp("apart")
    (folder / "apart.mission").write_text(APART)
    words = ["compile", str(folder / "apart.mission"), "-D", "FAR=6.5 m", "--certify", "--explain-limit", "0"]
    status, said = run([*words, "-o", str(folder / "out")])
    assert status == 6, said
    files = (path for path in (folder / "out").rglob("*") if path.is_file())
    return {path.relative_to(folder / "out").as_posix(): path.read_bytes() for path in files}


def laid(folder: Path, files: dict[str, bytes]) -> Path:
    for name, content in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content)
    return folder


def test_a_proof_is_verified_and_what_it_proves_is_said(proved: dict[str, bytes], tmp_path: Path) -> None:
    status, said = run(["verify", str(laid(tmp_path / "x", proved))])
    assert status == 0
    assert "proved: no motion of these agents satisfies `stay`, `close` and `visit` together" in said
    assert "with `-D FAR=6.5 m`" in said
    status, said = run(["verify", str(tmp_path / "x"), "--format", "json"])
    document = json.loads(said)
    assert (status, document["passed"], document["failures"]) == (0, True, [])
    assert document["proven"].startswith("no motion")


def test_it_is_of_the_parameters_that_the_command_line_gave(proved: dict[str, bytes], tmp_path: Path) -> None:
    """Without them the mission is another one, and its clauses are others."""
    manifest = json.loads(proved["manifest.json"])
    assert manifest["options"]["-D FAR"] == "6.5 m"
    del manifest["options"]["-D FAR"]
    changed = {**proved, "manifest.json": json.dumps(manifest).encode()}
    status, said = run(["verify", str(laid(tmp_path / "x", changed))])
    assert status == 5
    assert "MC714" in said
    assert "labels of all" in said


@pytest.mark.parametrize("name", ["cover.json", "impossible.cnf", "impossible.drat", "mission/apart.mission"])
def test_a_file_that_was_changed_is_named(proved: dict[str, bytes], tmp_path: Path, name: str) -> None:
    changed = {**proved, name: proved[name].replace(b"1", b"2", 1)}
    status, said = run(["verify", str(laid(tmp_path / "x", changed))])
    assert status in (1, 5)
    assert ("MC714" in said and f"file `{name}`: its content has changed" in said) or status == 1


@pytest.mark.parametrize(
    ("key", "value", "why"),
    [
        ("mission", "another", "invalid `mission`: `another`"),
        ("versions", {"missionc": "1.0"}, "its `versions` do not name the compiler"),
        ("versions", {"missionc": "1.0", "python": "a b"}, "invalid version of `python`: `a b`"),
        ("options", {"-D FAR": "6.5 m", "nodes": "few"}, "invalid option `nodes`: `few`"),
        ("seed", 1, "unexpected or missing key `seed`"),
    ],
)
def test_an_entry_of_the_manifest_that_cannot_be_is_named(
    proved: dict[str, bytes], tmp_path: Path, key: str, value: object, why: str
) -> None:
    manifest = json.loads(proved["manifest.json"]) | {key: value}
    status, said = run(
        ["verify", str(laid(tmp_path / "x", {**proved, "manifest.json": json.dumps(manifest).encode()}))]
    )
    assert status == 5
    assert "MC714" in said
    assert why in " ".join(said.split())


def test_a_file_that_no_proof_has_is_named_though_the_manifest_lists_it(
    proved: dict[str, bytes], tmp_path: Path
) -> None:
    manifest = json.loads(proved["manifest.json"])
    manifest["files"]["plan.json"] = hashlib.sha256(b"{}").hexdigest()
    changed = {**proved, "plan.json": b"{}", "manifest.json": json.dumps(manifest).encode()}
    status, said = run(["verify", str(laid(tmp_path / "x", changed))])
    assert (status, "plan.json: unexpected file in a proof folder" in said) == (5, True)


def test_what_lies_beside_the_files_is_named(proved: dict[str, bytes], tmp_path: Path) -> None:
    status, said = run(["verify", str(laid(tmp_path / "x", {**proved, "more.txt": b""}))])
    assert (status, "file `more.txt`: not listed in the manifest" in said) == (5, True)


def test_a_file_that_is_missing_makes_the_folder_unreadable(proved: dict[str, bytes], tmp_path: Path) -> None:
    left = {name: content for name, content in proved.items() if name != "impossible.drat"}
    status, said = run(["verify", str(laid(tmp_path / "x", left))])
    assert (status, "MC708" in said) == (1, True)


def test_a_folder_with_a_proof_is_no_plan_to_be_drawn_or_exported(proved: dict[str, bytes], tmp_path: Path) -> None:
    folder = str(laid(tmp_path / "x", proved))
    for words in (["report", folder], ["export", folder, "--to", "csv"], ["simulate", folder]):
        status, said = run(words)
        assert status != 0
        assert "Traceback" not in said


def test_a_proof_about_roadmaps_says_what_it_does_not_show(tmp_path: Path) -> None:
    (tmp_path / "hops.mission").write_text(ROADMAPS)
    words = ["compile", str(tmp_path / "hops.mission"), "--certify", "--explain-limit", "0"]
    status, said = run([*words, "-o", str(tmp_path / "out")])
    assert status == 4, said
    status, said = run(["verify", str(tmp_path / "out")])
    assert status == 0, said
    assert "proved: the clauses in `impossible.cnf` are unsatisfiable" in said


def test_a_proof_is_of_the_mission_at_its_own_pace(tmp_path: Path) -> None:
    """`--stretch` is how much slower a plan is flown; where there is none, nothing is slower."""
    (tmp_path / "apart.mission").write_text(APART)
    words = ["compile", str(tmp_path / "apart.mission"), "-D", "FAR=6.5 m", "--stretch", "1.5", "--certify"]
    status, said = run([*words, "--explain-limit", "0", "-o", str(tmp_path / "out")])
    assert status == 6, said
    assert run(["verify", str(tmp_path / "out")])[0] == 0
