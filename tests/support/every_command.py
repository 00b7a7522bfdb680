"""One mission in every command, in this process: each must answer, and the answers must agree."""

from __future__ import annotations

import contextlib
import io
import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from missionc.cli.app import main
from missionc.cli.exit_status import Status
from missionc.output.export.formats import FORMATS

NEAR = 1e-5
"""Tolerance for robustness in metres, due to the digits in files."""


@dataclass(frozen=True)
class Ended:
    """Result of a mission: ``refused`` by the check, or an outcome of ``compile``.

    Args:
        codes: codes of the reported errors.
        backend: backend of the plan or attempt.
    """

    outcome: str
    codes: tuple[str, ...] = ()
    backend: str = ""


def said(*words: str) -> tuple[int, dict[str, Any]]:
    """Status and document of a command; a defect raises if ``MISSIONC_TRACEBACK`` is set."""
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        status = main([*words, "--format", "json"])
    assert status not in (Status.DEFECT, Status.USAGE), (words, out.getvalue(), err.getvalue())
    document: dict[str, Any] = json.loads(out.getvalue())
    assert not [each for each in document["diagnostics"] if each["code"] == "MC613"], (words, document["diagnostics"])
    return status, document


def codes(document: dict[str, Any]) -> tuple[str, ...]:
    return tuple(sorted({each["code"] for each in document["diagnostics"] if each["severity"] == "error"}))


def taken_through(files: dict[str, str], folder: Path, flags: tuple[str, ...] = ()) -> Ended:
    """Write the files, ``m.mission`` first, and run every command on them.

    Args:
        flags: flags for ``compile``.

    Raises:
        AssertionError: two answers contradict each other, or a plan is invalid.
    """
    folder.mkdir(parents=True)
    for name, text in files.items():
        (folder / name).write_text(text, encoding="utf-8")
    mission = str(folder / "m.mission")
    status, checked = said("check", mission)
    if status:
        assert codes(checked)
        said("explain", mission)
        return Ended("refused", codes(checked))
    _described(mission)
    out = folder / "out"
    status, compiled = said("compile", mission, "-o", str(out), "--quiet", *flags)
    ended = Ended(str(compiled["outcome"]), codes(compiled), str(compiled["backend"]))
    assert ended.outcome != "unverified", compiled["diagnostics"]
    assert (status == Status.DONE) == (ended.outcome == "planned")
    if ended.outcome == "planned":
        _read_again(mission, out, "--continuous" in flags)
    return ended


def _described(mission: str) -> None:
    status, _ = said("explain", mission)
    assert status == Status.DONE
    status, staged = said("compile", mission, "--emit", "ast,ir,kernel,horizons,backend")
    assert status == Status.DONE, staged
    before = Path(mission).read_text(encoding="utf-8")
    status, _ = said("fmt", mission)
    assert status == Status.DONE
    assert said("fmt", "--check", mission)[0] == Status.DONE
    status, staged_again = said("compile", mission, "--emit", "kernel")
    assert staged_again["emit"]["kernel"] == staged["emit"]["kernel"], "the layout changes what is meant"
    Path(mission).write_text(before, encoding="utf-8")


def _read_again(mission: str, out: Path, continuous: bool) -> None:
    """Run every command on a folder from ``compile``."""
    status, verified = said("verify", str(out))
    assert status == Status.DONE, verified
    status, drawn = said("report", str(out), "-o", str(out.with_suffix(".html")))
    assert status == Status.DONE, drawn
    for name in FORMATS:
        status, exported = said("export", str(out), name, "-o", str(out.with_name(f"as_{name}")))
        assert status == Status.DONE or set(codes(exported)) <= {"MC712", "MC404"}, exported
    certificate = json.loads((out / "certificate.json").read_text(encoding="utf-8"))
    certified = {each["subject"]: each["margin"] for each in certificate["checks"] if each["name"] == "requirement"}
    for name in ("plan.json", "trajectories.csv"):
        status, judged = said("monitor", mission, str(out / name))
        assert status == Status.DONE, (name, judged)
        found = {each["name"]: each["robustness"] for each in judged["requirements"]}
        assert found.keys() == certified.keys()
        for requirement, margin in certified.items():
            assert _same(found[requirement], margin), (name, requirement, found[requirement], margin)
    status, between = said("monitor", mission, str(out / "plan.json"), "--continuous")
    assert status in (Status.DONE, Status.VIOLATED), between
    if continuous:
        assert all(each["verdict"] == "holds throughout" for each in certificate["between_steps"])


def _same(one: float | str | None, other: float | str | None) -> bool:
    if isinstance(one, int | float) and isinstance(other, int | float):
        return math.isclose(one, other, abs_tol=NEAR)
    return one == other
