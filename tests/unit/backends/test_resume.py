"""A run that is kept and taken up again: it ends as it would have ended, or says why it cannot be."""

from __future__ import annotations

import io
import json
import os
import signal
import subprocess
import sys
import time
import zipfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("torch")

from missionc.backends import load
from missionc.backends.api import NotFound, Reason, Snapshot
from missionc.backends.clot import backend as clot
from missionc.backends.clot.backend import TransportRun
from missionc.backends.clot.run.run_state import Nearest
from missionc.backends.options import Options
from missionc.base.continuous_time import ContinuousTime
from missionc.base.diagnostics.code import CHECKPOINT_MISMATCH, CHECKPOINT_UNREADABLE, FILE_TOO_LARGE, NOT_ITS_FLAG
from missionc.base.diagnostics.model import Diagnostic
from missionc.base.limits import Limits
from missionc.base.source import Source
from missionc.base.units import Seconds
from missionc.cli import app
from missionc.compiler import driver
from missionc.compiler.checkpoint_file import SCHEMA, from_bytes, to_bytes
from missionc.compiler.results import Compiled, InvalidMission, Verified
from missionc.frontend.syntax.read_file import read_bytes
from tests.support.small_missions import SMALL
from tests.unit.cli.test_cut_short import LIMIT, MIXED, ROW, time_is_up

ROOT = Path(__file__).resolve().parents[3]
PAIR = ROW.split("prefer")[0]
NEVER = PAIR + "require never: always[0, 4 s] (not row or distance(drone[0], drone[1]) >= 2)\n"
RUN = {"mission": "a", "seed": "0"}


SEARCH_EVERY = 4
SEARCHED = {"clot.search_every": SEARCH_EVERY}
"""Settings by which the fourth attempt is a search."""


def compiled(
    text: str,
    *,
    backend: str = "clot",
    preset: str = "sketch",
    samples: int | None = None,
    keep: Callable[[bytes], object] | None = None,
    resume: bytes | None = None,
    seed: int = 0,
    limit: float = LIMIT,
    throughout: ContinuousTime = ContinuousTime.WANTED,
    settings: dict[str, int] | None = None,
) -> Compiled:
    return driver.compile(
        Source("a.mission", text),
        settings=settings,
        backend=backend,
        options=Options(preset=preset, samples=samples),
        keep=keep,
        resume=resume,
        seed=seed,
        time_limit=Seconds(limit),
        continuous_time=throughout,
    )


def files(result: Compiled) -> Mapping[str, bytes]:
    assert isinstance(result.outcome, Verified), result.outcome
    return result.outcome.files


def ends_the_same(text: str, **options: Any) -> list[bytes]:
    """Interrupted at the beginning, on the way and at the end, and taken up again: the same bytes."""
    kept: list[bytes] = []
    whole = compiled(text, keep=kept.append, **options)
    for moment in sorted({0, len(kept) // 2, len(kept) - 1}):
        assert files(compiled(text, resume=kept[moment], **options)) == files(whole), moment
    return kept


def words(content: bytes) -> dict[str, object]:
    with np.load(io.BytesIO(content)) as arrays:
        return json.loads(arrays["words"].tobytes())["words"]  # type: ignore[no-any-return]


def test_a_run_that_was_at_work_on_a_better_plan_is_taken_up_there() -> None:
    kept = ends_the_same(ROW)
    assert words(kept[-1])["reached"] is True
    assert words(kept[0])["reached"] is False


def test_a_search_is_taken_up_between_two_of_its_rounds() -> None:
    kept = ends_the_same(PAIR, preset="search", samples=16)
    assert words(kept[len(kept) // 2])["search"] is not None
    assert len(kept) > 3


def test_a_hybrid_run_is_taken_up_too() -> None:
    """No plan is asked for that holds between the steps: of those there are no checkpoints."""
    ends_the_same(MIXED, backend="hybrid", throughout=ContinuousTime.AT_STEPS)


def test_a_later_attempt_knows_the_best_candidate_of_those_before(monkeypatch: pytest.MonkeyPatch) -> None:
    """Some attempts are a search from the best schedule so far; here none before the first of those may succeed."""
    judged = TransportRun.judged

    def strict(run, polished, made, begun):  # type: ignore[no-untyped-def]
        if run.account.sizes["attempts"] >= SEARCH_EVERY:
            return judged(run, polished, made, begun)
        come_to = clot.attempt(run.mission, run.kernel, made)
        nearest = Nearest(polished.control, polished.shortfall, begun.number, begun.motion)
        run.best = run.best or clot.RunCandidate(nearest, come_to)
        return None

    monkeypatch.setattr(TransportRun, "judged", strict)
    kept: list[bytes] = []
    whole = compiled(PAIR, keep=kept.append, settings=SEARCHED)
    assert {words(each)["number"] for each in kept} == set(range(SEARCH_EVERY))
    searching = [each for each in kept if words(each)["search"] is not None]
    assert searching, "no attempt was a search"
    assert words(searching[0])["nearest"]["sketch"] == 0  # type: ignore[index]
    for moment in (kept[0], kept[2], searching[0], searching[-1]):
        assert files(compiled(PAIR, resume=moment, settings=SEARCHED)) == files(whole)


def test_the_time_limit_keeps_what_was_done_and_nothing_that_was_cut_short(monkeypatch: pytest.MonkeyPatch) -> None:
    kept: list[bytes] = []

    def keep(content: bytes) -> None:
        kept.append(content)
        if words(content)["number"] == 2:
            time_is_up(monkeypatch)

    found = compiled(NEVER, keep=keep)
    assert isinstance(found.outcome, NotFound)
    assert found.outcome.reason is Reason.TIME
    assert [words(each)["number"] for each in kept] == [0, 1, 2], "the third was cut short, and is to be done again"
    monkeypatch.undo()
    again: list[bytes] = []

    def keep_one(content: bytes) -> None:
        again.append(content)
        time_is_up(monkeypatch)

    compiled(NEVER, keep=keep_one, resume=kept[-1])
    assert again == kept[-1:], "it goes on where it was"


# ------------------------------------------------------------- what is refused


def refused(text: str, resume: bytes, **options: str | int) -> Diagnostic:
    found = compiled(text, resume=resume, **options)  # type: ignore[arg-type]
    assert isinstance(found.outcome, InvalidMission)
    return found.findings[-1]


@pytest.fixture(scope="module")
def kept() -> bytes:
    """A checkpoint of a search that is half-way."""
    found: list[bytes] = []
    compiled(PAIR, preset="search", samples=16, keep=found.append)
    return found[len(found) // 2]


SAME = {"preset": "search", "samples": 16}


def test_a_checkpoint_of_another_mission_is_refused(kept: bytes) -> None:
    finding = refused(PAIR.replace("8, 6", "8, 7"), kept, **SAME)
    assert finding.code is CHECKPOINT_MISMATCH
    assert finding.notes[0] == "the mission is different or has changed"


def test_a_checkpoint_of_another_seed_or_preset_is_refused_and_says_which(kept: bytes) -> None:
    finding = refused(PAIR, kept, seed=3, **SAME)
    assert finding.code is CHECKPOINT_MISMATCH
    assert finding.notes[0] == "the seed is `0` in the checkpoint and `3` in this run"
    assert (
        "the preset is `search` in the checkpoint and `paper` in this run"
        in refused(PAIR, kept, preset="paper", samples=16).notes
    )
    assert "the samples is `16` in the checkpoint and not set in this run" in refused(PAIR, kept, preset="search").notes


def test_a_checkpoint_of_another_version_is_refused(kept: bytes, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys.modules["missionc.output.folder.manifest"], "__version__", "99.0")
    finding = refused(PAIR, kept, **SAME)
    assert finding.code is CHECKPOINT_MISMATCH
    assert "version of missionc" in finding.notes[0]


def changed(content: bytes, arrays: dict[str, np.ndarray] | None = None, **about: object) -> bytes:
    """The checkpoint with other arrays or words, written as numpy writes it."""
    with np.load(io.BytesIO(content)) as file:
        members = dict(file)
    text = json.loads(members["words"].tobytes())
    text["words"] |= about.pop("words", {})
    text |= about
    members["words"] = np.frombuffer(json.dumps(text).encode(), dtype=np.uint8)
    out = io.BytesIO()
    np.savez(out, **{**members, **(arrays or {})})  # type: ignore[arg-type]
    return out.getvalue()


def test_a_checkpoint_of_another_form_is_refused(kept: bytes) -> None:
    finding = refused(PAIR, changed(kept, schema="missionc.checkpoint/9"), **SAME)
    assert finding.code is CHECKPOINT_MISMATCH
    assert SCHEMA in finding.notes[0]


def test_a_checkpoint_that_is_damaged_is_refused_or_holds_what_it_held() -> None:
    whole = to_bytes(Snapshot({"x": np.arange(5.0), "y": np.eye(2)}, {"number": 3}), RUN)
    assert isinstance(from_bytes(whole, "run.npz", RUN), Snapshot)
    told = 0
    for place in range(len(whole)):
        broken = bytearray(whole)
        broken[place] ^= 0x55
        found = from_bytes(bytes(broken), "run.npz", RUN)
        if isinstance(found, Diagnostic):
            told += 1
            continue
        assert found.words == {"number": 3}
        assert [array.tolist() for array in found.arrays.values()] == [np.arange(5.0).tolist(), np.eye(2).tolist()]
    assert told > len(whole) / 2
    for end in range(len(whole)):
        finding = from_bytes(whole[:end], "run.npz", RUN)
        assert isinstance(finding, Diagnostic)
        assert finding.code is CHECKPOINT_UNREADABLE


def zipped(compression: int = zipfile.ZIP_STORED, **members: bytes) -> bytes:
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", compression) as archive:
        for name, content in members.items():
            archive.writestr(f"{name}.npy", content)
    return out.getvalue()


def saved(array: np.ndarray, allow_pickle: bool = False) -> bytes:
    out = io.BytesIO()
    np.save(out, array, allow_pickle=allow_pickle)
    return out.getvalue()


def claims(shape: str, kind: str = "<f8") -> bytes:
    """An array of no content whose header claims more."""
    header = f"{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}".encode()
    header += b" " * (118 - len(header) - 1) + b"\n"
    return b"\x93NUMPY\x01\x00" + len(header).to_bytes(2, "little") + header


HOSTILE = {
    "no archive": b"not a zip",
    "nothing": b"",
    "an empty archive": zipped(),
    "a bomb": zipped(zipfile.ZIP_DEFLATED, words=saved(np.zeros(1 << 22, dtype=np.uint8))),
    "a pickle": zipped(words=saved(np.array([{}], dtype=object), allow_pickle=True)),
    "a huge shape": zipped(words=claims("(1000000000000,)", "|u1")),
    "a negative shape": zipped(words=claims("(-1,)", "|u1")),
    "a header that is code": zipped(words=claims("__import__('os').system('true')", "|u1")),
    "no words": zipped(numbers=saved(np.zeros(3))),
    "words that are no JSON": zipped(words=saved(np.frombuffer(b"{", dtype=np.uint8))),
    "words that are nested deep": zipped(words=saved(np.frombuffer(b"[" * 200_000, dtype=np.uint8))),
    "words that are a list": zipped(words=saved(np.frombuffer(b"[]", dtype=np.uint8))),
    "words that are short": zipped(words=saved(np.frombuffer(b"{}", dtype=np.uint8))),
    "many arrays": zipped(**{f"a{number}": saved(np.zeros(1)) for number in range(100)}),
}


@pytest.mark.parametrize("content", HOSTILE.values(), ids=HOSTILE)
def test_what_is_no_checkpoint_is_refused(content: bytes) -> None:
    finding = from_bytes(content, "run.npz", RUN)
    assert isinstance(finding, Diagnostic)
    assert finding.code is CHECKPOINT_UNREADABLE


def test_numbers_that_are_not_finite_are_refused() -> None:
    content = to_bytes(Snapshot({"x": np.array([np.nan])}, {}), RUN)
    assert isinstance(from_bytes(content, "run.npz", RUN), Diagnostic)
    content = to_bytes(Snapshot({"x": np.array([1.5])}, {"y": [1]}), RUN)
    found = from_bytes(content, "run.npz", RUN)
    assert isinstance(found, Snapshot)
    assert (found.arrays["x"].tolist(), found.words) == ([1.5], {"y": [1]})


MADE_UP = {
    "no number": {"words": {"number": "three"}},
    "less than no attempt": {"words": {"number": -1}},
    "a candidate without a motion": {"words": {"nearest": {"shortfall": 1.0, "sketch": 0}}},
    "a plan that is not there": {"words": {"reached": True}},
    "a search that is no text": {"words": {"search": {"text": "[]", "planned": 1, "margin": None}}},
    "a plan of another shape": {"words": {"reached": True}, "arrays": {"reached.control": np.zeros((1, 2, 2))}},
    "a search of other steps": {"arrays": {"search.motion": np.zeros((3, 2, 2))}},
    "parents that come later": {"arrays": {"search.parent": np.full(4, 1e18)}},
    "visits below none": {"arrays": {"search.visits": np.full(2, -1.0)}},
    "notes that are none": {"words": {"notes": 3}},
}


@pytest.mark.parametrize("change", MADE_UP.values(), ids=MADE_UP)
def test_what_holds_no_run_is_refused(kept: bytes, change: dict[str, dict[str, object]]) -> None:
    finding = refused(PAIR, changed(kept, change.get("arrays"), words=change.get("words", {})), **SAME)  # type: ignore[arg-type]
    assert finding.code is CHECKPOINT_UNREADABLE


def test_a_plan_in_a_checkpoint_is_not_believed() -> None:
    kept: list[bytes] = []
    compiled(ROW, keep=kept.append)
    with np.load(io.BytesIO(kept[-1])) as file:
        control = file["reached.control"]
    control[:, 3] += 100.0
    finding = refused(ROW, changed(kept[-1], {"reached.control": control}))
    assert finding.code is CHECKPOINT_UNREADABLE
    assert finding.notes == ("the plan in the checkpoint is invalid",)


def test_a_checkpoint_is_refused_where_the_mission_goes_to_a_solver(tmp_path: Path) -> None:
    finding = load.load("smt", checkpoint=True)
    assert isinstance(finding, Diagnostic)
    assert finding.code is NOT_ITS_FLAG
    (tmp_path / "small.mission").write_text(SMALL)
    assert app.main(["compile", str(tmp_path / "small.mission"), "--checkpoint", str(tmp_path / "run.npz")]) == 1


def test_a_file_that_is_too_large_is_refused_before_it_is_read(tmp_path: Path) -> None:
    path = tmp_path / "run.npz"
    with path.open("wb") as file:
        file.truncate(1 << 40)
    finding = read_bytes(path, "run.npz", Limits().checkpoint_bytes, CHECKPOINT_UNREADABLE)
    assert isinstance(finding, Diagnostic)
    assert finding.code is FILE_TOO_LARGE
    assert "--limit checkpoint_bytes=" in str(finding.help)


# ------------------------------------------------------------- on the command line


def command(folder: Path, *more: str) -> list[str]:
    return ["compile", str(folder / "row.mission"), "--backend", "clot", *more]


def test_the_command_keeps_a_run_and_takes_it_up_again(tmp_path: Path) -> None:
    (tmp_path / "row.mission").write_text(ROW)
    run = str(tmp_path / "run.npz")
    assert app.main(command(tmp_path, "--checkpoint", run, "-o", str(tmp_path / "one"))) == 0
    assert app.main(command(tmp_path, "--resume", run, "--checkpoint", run, "-o", str(tmp_path / "two"))) == 0
    one, two = (
        {path.relative_to(tmp_path / name): path.read_bytes() for path in (tmp_path / name).rglob("*.*")}
        for name in ("one", "two")
    )
    assert one == two
    assert sorted(path.name for path in tmp_path.iterdir()) == ["one", "row.mission", "run.npz", "two"]


def test_the_command_says_what_is_wrong_with_a_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "row.mission").write_text(ROW)
    (tmp_path / "run.npz").write_bytes(b"nothing")
    assert app.main(command(tmp_path, "--resume", str(tmp_path / "run.npz"))) == 1
    assert "error[MC706]" in capsys.readouterr().err
    assert app.main(command(tmp_path, "--checkpoint", str(tmp_path / "nowhere" / "run.npz"))) == 1
    assert "error[MC702]" in capsys.readouterr().err
    assert app.main(command(tmp_path, "--checkpoint", str(tmp_path))) == 2


def test_a_disk_that_fills_up_does_not_lose_the_plan(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "row.mission").write_text(PAIR)
    write_file = "missionc.output.folder.write_folder.write_file"
    full = Diagnostic(CHECKPOINT_UNREADABLE, "full", None)
    monkeypatch.setattr(write_file, lambda *_: full)
    status = app.main(command(tmp_path, "--checkpoint", str(tmp_path / "run.npz"), "-o", str(tmp_path / "out")))
    assert (tmp_path / "out" / "plan.json").exists()
    assert status == 1


@pytest.mark.parametrize(("number", "status"), [(signal.SIGINT, 130), (signal.SIGKILL, -9)])
def test_whoever_is_stopped_leaves_a_whole_checkpoint(tmp_path: Path, number: int, status: int) -> None:
    (tmp_path / "row.mission").write_text(NEVER)
    words = [sys.executable, "-m", "missionc", *command(tmp_path, "--checkpoint", str(tmp_path / "run.npz"))]
    process = subprocess.Popen(words, cwd=tmp_path, env={**os.environ, "PYTHONPATH": str(ROOT)})
    while process.poll() is None and not (tmp_path / "run.npz").exists():
        time.sleep(0.02)
    time.sleep(0.5)
    begin = time.monotonic()
    process.send_signal(number)
    assert process.wait(timeout=30) == status
    assert time.monotonic() - begin < 2.0
    left = {path.name for path in tmp_path.iterdir() if ".missionc-" not in path.name}
    assert left == {"row.mission", "run.npz"}
    assert app.main(command(tmp_path, "--resume", str(tmp_path / "run.npz"), "--time-limit", "0.1")) == 4
