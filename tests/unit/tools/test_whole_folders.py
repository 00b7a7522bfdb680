"""A folder is judged whole: what it says, what it holds, and nothing that lies outside of it."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from missionc.base.limits import Limits
from missionc.cli.app import main
from missionc.tools.replay.read_folder import OutputFolder, read_folder
from missionc.tools.replay.rebuild.manifest_entries import check_manifest
from missionc.tools.replay.reverify import Reverified, reverify
from tests.support.forged_folders import Files, forged, hashed, laid
from tests.support.whole_folder import files

pytestmark = pytest.mark.usefixtures("flown_once")


def refused(replayed: Reverified) -> dict[str, str]:
    """Of each document that fails, the reason."""
    assert replayed.certificate is not None
    return {check.subject: check.detail for check in replayed.certificate.failures}


def opened(folder: Path) -> OutputFolder:
    found = read_folder(folder)
    assert isinstance(found, OutputFolder)
    return found


def edited(name: str, change: Callable[[Any], None]) -> Files:
    document = json.loads(files()[name])
    change(document)
    return {**files(), name: json.dumps(document).encode()}


def test_a_folder_with_everything_in_it_passes(tmp_path: Path) -> None:
    replayed = reverify(forged(tmp_path, files()))
    assert replayed.passed
    assert replayed.certificate is not None
    subjects = {check.subject for check in replayed.certificate.checks if check.name == "document"}
    assert {"plan.json", "trajectories.csv", "report.html", "simulation.json", "manifest.json"} <= subjects
    assert {"export/crazyswarm2/fly.py", "export/skybrush/show.skyc", "crazyflie/drone0.csv"} <= subjects


# ------------------------------------------------------------- what a folder says


def nicer(plan: Any) -> None:
    plan["requirements"][0]["robustness"] = 9.99


def linked(plan: Any) -> None:
    plan["graphs"]["radio"][0] = []


def thinner(plan: Any) -> None:
    plan["agents"][0]["radius"] = 0.01


def aside(plan: Any) -> None:
    """A state between the first two steps, three metres beside both."""
    plan["times"].insert(1, 0.5)
    for agent in plan["agents"]:
        agent["position"].insert(1, [agent["position"][0][0] + 3, agent["position"][0][1]])
        agent["velocity"].insert(1, agent["velocity"][0])
        agent["yaw"].insert(1, agent["yaw"][0])


def longer(plan: Any) -> None:
    plan["horizon"] = 9.0


def more(plan: Any) -> None:
    plan["approved_by"] = "nobody"


def another(plan: Any) -> None:
    plan["agents"][0]["team"] = "scout"


@pytest.mark.parametrize("change", [nicer, linked, thinner, aside, longer, more, another])
def test_a_plan_says_no_more_than_its_states_come_to(change: Callable[[Any], None], tmp_path: Path) -> None:
    assert set(refused(reverify(forged(tmp_path, edited("plan.json", change))))) >= {"plan.json"}


def test_a_table_has_the_states_of_the_plan(tmp_path: Path) -> None:
    lines = files()["trajectories.csv"].decode().splitlines()
    agent, time, x, *rest = lines[2].split(",")
    lines[2] = ",".join([agent, time, repr(float(x) + 1.0), *rest])
    found = refused(reverify(forged(tmp_path, {**files(), "trajectories.csv": ("\n".join(lines) + "\n").encode()})))
    assert found == {"trajectories.csv": "it does not contain the states of `plan.json`"}


@pytest.mark.parametrize("name", ["trajectories.csv", "report.html", "certificate.json", "export/px4/Drone 1.csv"])
def test_a_file_that_nobody_lists_any_more_is_missing(name: str, tmp_path: Path) -> None:
    found = {key: content for key, content in files().items() if key != name}
    manifest = json.loads(found["manifest.json"])
    del manifest["files"][name]
    found["manifest.json"] = json.dumps(manifest).encode()
    assert refused(reverify(forged(tmp_path, found)))[name] == "it is missing"


def test_numbers_in_another_spelling_are_not_the_ones_that_were_verified(tmp_path: Path) -> None:
    """Python reads ``1_0`` as ten, and C as one."""
    text = files()["crazyflie/drone0.csv"].decode()
    first = text.splitlines()[1].split(",")[0]
    found = {**files(), "crazyflie/drone0.csv": text.replace(f"\n{first},", f"\n+{first},", 1).encode()}
    reasons = refused(reverify(forged(tmp_path, found)))
    assert "its numbers are not in the format of the compiler" in reasons["crazyflie/drone0.csv"]


@pytest.mark.parametrize("old", [b"drone[0]", b"requirement", b"<title>", b"function"])
def test_a_page_shows_what_was_verified(old: bytes, tmp_path: Path) -> None:
    page = files()["report.html"]
    assert old in page
    found = {**files(), "report.html": page.replace(old, b"x" + old, 1)}
    assert set(refused(reverify(forged(tmp_path, found)))) == {"report.html"}


def test_what_is_met_to_rounding_is_still_about_somebody_at_some_time(tmp_path: Path) -> None:
    """Which rounding is worst depends on the machine, so that the time may be another, but not any."""

    def nobody(certificate: Any) -> None:
        next(check for check in certificate["checks"] if check["name"] == "joints")["agents"] = ["nobody"]

    def never(certificate: Any) -> None:
        next(check for check in certificate["checks"] if check["name"] == "joints")["at"] = 99.0

    def later(certificate: Any) -> None:
        next(check for check in certificate["checks"] if check["name"] == "joints")["at"] = 2.5

    def stated(change: Callable[[Any], None], folder: str) -> bool:
        replayed = reverify(forged(tmp_path / folder, edited("certificate.json", change)))
        return "checks" not in refused(replayed)

    assert [stated(nobody, "a"), stated(never, "b"), stated(later, "c")] == [False, False, True]
    page = files()["report.html"].replace(b'"agents":["drone[0]"]', b'"agents":["nobody"]')
    assert "report.html" in refused(reverify(forged(tmp_path / "d", {**files(), "report.html": page})))


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("mission", "another"),
        ("backend", "magic"),
        ("backend", {}),
        ("seed", -1),
        ("seed", True),
        ("seed", 2**63),
        ("seed", 1.5),
        ("cut_short", "boredom"),
        ("versions", {}),
        ("versions", {"missionc": "1", "python": "3", "sabotage": "1"}),
        ("versions", {"missionc": "", "python": "3"}),
        ("options", []),
        ("options", {"solver": "abacus"}),
        ("options", {"samples": "0"}),
        ("options", {"margin": "-1.0"}),
        ("options", {"export": "px4,px4"}),
        ("options", {"colour": "red"}),
        ("signed", True),
    ],
)
def test_a_manifest_says_nothing_that_cannot_be(key: str, value: object, tmp_path: Path) -> None:
    found = edited("manifest.json", lambda manifest: manifest.update({key: value}))
    assert "manifest.json" in {
        check.subject for check in check_manifest(opened(laid(tmp_path, found))) if not check.passed
    }


# ------------------------------------------------------------ what a folder holds


def listed(name: str, content: bytes) -> Files:
    """With a file more, that the manifest lists too."""
    found = {**files(), name: content}
    manifest = json.loads(found["manifest.json"])
    manifest["files"][name] = ""
    return hashed({**found, "manifest.json": json.dumps(manifest).encode()})


@pytest.mark.parametrize("name", ["crazyflie/zz_extra.csv", "notes.txt", "export/crazyswarm2/more.py", "empty/"])
def test_what_the_manifest_does_not_list_is_refused_by_name(name: str, tmp_path: Path) -> None:
    folder = laid(tmp_path, files())
    if name.endswith("/"):
        (folder / name).mkdir()
    else:
        (folder / name).write_bytes(files()["crazyflie/drone0.csv"])
    replayed = reverify(folder)
    assert refused(replayed) == {name.rstrip("/"): "not listed in the manifest"}
    assert any(f"`{name.rstrip('/')}`: not listed in the manifest" in note for note in replayed.findings[0].notes)


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("crazyflie/zz_extra.csv", "unexpected file for this mission"),
        ("notes.txt", "unexpected file for this mission"),
        ("mission/other.mission", "does not include it"),
        ("export/crazyswarm2/more.py", "not a file of this export"),
        ("export/warp/fly.py", "unknown export"),
        ("export/mcap/flight.mcap", "do not include this export"),
        ("export/fly.py", "unknown export"),
    ],
)
def test_a_listed_file_that_no_compiler_writes_is_refused(name: str, words: str, tmp_path: Path) -> None:
    assert any(words in reason for reason in refused(reverify(laid(tmp_path, listed(name, b"x")))).values())


@pytest.mark.parametrize("name", ["fly.py", "crazyflies.yaml", "README.md", "trajectories/drone0.csv"])
def test_an_export_is_made_once_more_and_compared(name: str, tmp_path: Path) -> None:
    path = f"export/crazyswarm2/{name}"
    found = {**files(), path: files()[path].replace(b"0", b"1", 1)}
    reasons = refused(reverify(forged(tmp_path, found)))
    assert reasons == {path: "it does not match the verified polynomials"}


def test_an_export_that_cannot_be_made_here_is_not_verified(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("mcap")
    found = listed("export/mcap/flight.mcap", b"x")
    manifest = json.loads(found["manifest.json"])
    manifest["options"]["export"] += ",mcap"
    folder = laid(tmp_path, {**found, "manifest.json": json.dumps(manifest).encode()})
    assert refused(reverify(folder)) == {"export/mcap/flight.mcap": "it does not match the verified polynomials"}
    monkeypatch.setattr("missionc.output.export.export_form.find_spec", lambda name: None)
    (reason,) = refused(reverify(folder)).values()
    assert "cannot be rebuilt" in reason
    assert "pip install 'missionc[export]'" in reason


def test_another_hash_of_an_input_is_refused(tmp_path: Path) -> None:
    found = edited("manifest.json", lambda manifest: manifest["inputs"].update({"a.mission": "0" * 64}))
    assert refused(reverify(laid(tmp_path, found))) == {
        "mission/a.mission": "the manifest's `inputs` state another SHA-256 of it"
    }


# ------------------------------------------------- what lies outside, or is no file

SECRET = "the words of somebody else"


def said(folder: Path, capsys: pytest.CaptureFixture[str], command: str = "verify") -> str:
    words = {"verify": [], "report": ["-o", f"{folder}.html"], "simulate": [], "export": ["px4", "-o", f"{folder}-x"]}
    assert main([command, str(folder), *words[command]]) == 1
    return capsys.readouterr().err


@pytest.mark.parametrize("command", ["verify", "report", "simulate", "export"])
@pytest.mark.parametrize(
    "name", ["manifest.json", "plan.json", "mission/a.mission", "crazyflie", "mission", "export/px4", "stray.csv"]
)
def test_a_link_is_refused_by_name_and_not_followed(
    name: str, command: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder, outside = laid(tmp_path / "out", files()), tmp_path / "outside"
    if (folder / name).is_dir():
        (folder / name).rename(outside)
    else:
        outside.write_text(SECRET)
        (folder / name).unlink(missing_ok=True)
    (folder / name).symlink_to(outside)
    err = said(folder, capsys, command)
    assert "MC708" in err
    assert f"is not a plan folder: its `{name}` is a symbolic link" in err
    assert SECRET not in err


@pytest.mark.parametrize("name", ["plan.json", "crazyflie/pipe"])
def test_what_is_no_regular_file_is_refused_by_name(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = laid(tmp_path / "out", files())
    (folder / name).unlink(missing_ok=True)
    os.mkfifo(folder / name)
    assert f"is not a plan folder: its `{name}` is not a regular file" in said(folder, capsys)


def test_a_folder_may_be_named_through_a_link(tmp_path: Path) -> None:
    laid(tmp_path / "out", files())
    (tmp_path / "latest").symlink_to(tmp_path / "out")
    assert reverify(tmp_path / "latest").passed


@pytest.mark.parametrize(
    "name",
    [
        "./plan.json",
        "a/../plan.json",
        "crazyflie//drone0.csv",
        "/etc/hosts",
        "../out/plan.json",
        "",
        "Plan.json",
        "a\\b",
    ],
)
def test_a_name_in_another_spelling_is_refused(name: str, tmp_path: Path) -> None:
    def more(manifest: Any) -> None:
        manifest["files"][name] = manifest["files"]["plan.json"]

    findings = reverify(laid(tmp_path, edited("manifest.json", more))).findings
    assert [finding.code.name for finding in findings] == ["MC708"]
    assert f"names `{name}`" in findings[0].message


def test_no_more_is_read_than_the_limit_allows(tmp_path: Path) -> None:
    folder = laid(tmp_path, files())
    size = sum(len(content) for content in files().values())
    assert reverify(folder, Limits(trace_bytes=size)).passed
    (finding,) = reverify(folder, Limits(trace_bytes=size - 1)).findings
    assert finding.code.name == "MC004"
    assert finding.help == f"raise the limit with `--limit trace_bytes={size}`"


def test_each_file_is_read_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import missionc.tools.replay.read_folder as reading

    opened: list[str] = []
    read_inside = reading.read_inside

    def counted(folder: Path, name: str, limit: int) -> object:
        opened.append(name)
        return read_inside(folder, name, limit)

    monkeypatch.setattr(reading, "read_inside", counted)
    assert reverify(laid(tmp_path, files())).passed
    assert sorted(opened) == sorted(files())


# ---------------------------------------------------------------- numbers and texts


@pytest.mark.parametrize("text", ["9" * 400, "1e400", '"\\ud800"', "[" * 5_000 + "]" * 5_000, "NaN", "-1e308"])
@pytest.mark.parametrize("name", ["manifest.json", "plan.json", "certificate.json", "simulation.json"])
def test_every_strange_value_ends_in_a_code(name: str, text: str, tmp_path: Path) -> None:
    key = {"manifest.json": "seed", "plan.json": "step", "certificate.json": "checks", "simulation.json": "room"}[name]
    mark = '"@@@"'
    found = edited(name, lambda document: document.update({key: "@@@"}))
    found[name] = found[name].replace(mark.encode(), text.encode())
    replayed = reverify(laid(tmp_path, hashed(found, keep=name == "manifest.json")))
    assert [finding.code.name for finding in replayed.findings] in (["MC708"], ["MC709"], ["MC704"])


@pytest.mark.parametrize("stretch", ["1e308", "nan", "-2", "1001", "inf", "1e400", ""])
def test_a_stretch_beyond_all_sense_is_refused(stretch: str, tmp_path: Path) -> None:
    found = edited("manifest.json", lambda manifest: manifest["options"].update(stretch=stretch))
    findings = reverify(laid(tmp_path, found)).findings
    assert [finding.code.name for finding in findings] == ["MC708"]
    assert "`stretch`" in findings[0].message


def test_a_key_that_comes_twice_is_refused(tmp_path: Path) -> None:
    plan = files()["plan.json"].replace(b'"seed": 0', b'"seed": 0, "seed": 0', 1)
    findings = reverify(forged(tmp_path, {**files(), "plan.json": plan})).findings
    assert [finding.code.name for finding in findings] == ["MC704"]
    assert "is duplicated" in findings[0].message
