"""Extensions of other packages: found, loaded, and refused with a code of their own."""

from __future__ import annotations

import importlib
import json
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import missionc
from missionc import extension
from missionc.backends.api import BackendExtension, Budget, Impossible, NotFound, Outcome, Planned, Reason, Report
from missionc.backends.features import Feature
from missionc.backends.options import Options
from missionc.backends.registry import BACKENDS
from missionc.base.diagnostics.code import EXTENSION_FAILED
from missionc.base.extensions import ExtensionError, Kind, installed
from missionc.base.trace import Trace
from missionc.base.units import Seconds
from missionc.cli.app import main
from missionc.ir import Mission
from missionc.ir.kernel.nodes import Kernel
from tests.support.golden_pages import blocks, is_file
from tests.support.installed_packages import on_path, package, source_package

MISSION = """mission crossing
time step 1 s, horizon 4 s
world (0, 0) to (4, 2)
region goal = box (2.5, 0) to (4, 2)
team cart[1] { radius 0.1 m  dynamics single_integrator(speed <= 1 m/s)  start at (0.5, 1) }
require arrive: every cart: eventually[0, 4 s] goal
"""

BACKEND = """
from missionc.backends.api import BackendExtension, NotFound, Reason, Report

INTERFACE = 1


class Idle(BackendExtension):
    name = "idle"

    def plan(self, mission, kernel, options, budget):
        return NotFound(Reason.SOLVER, "idle plans nothing", Report())


BACKEND = Idle()
"""
EXAMPLE = Path(__file__).resolve().parents[3] / "examples" / "extension"
GROUP = "missionc.backends"

pytestmark = pytest.mark.usefixtures("roadmaps_alone")


class Straight(BackendExtension):
    """Every agent moves along the x-axis at a constant speed, m/s."""

    name = "straight"
    features = frozenset({Feature.DISTANCE})

    def __init__(self, speed: float) -> None:
        self.speed = speed

    def plan(self, mission: Mission, kernel: Kernel, options: Options, budget: Budget) -> Outcome:
        times = np.arange(mission.steps + 1) * mission.step
        position = np.zeros((1, len(times), 2))
        position[0, :, 0] = 0.5 + self.speed * times
        position[0, :, 1] = 1.0
        velocity = np.zeros_like(position)
        velocity[..., 0] = self.speed
        return Planned(Trace(mission.step, position, velocity, np.zeros(position.shape[:2])), Report())


@pytest.fixture
def mission(tmp_path: Path) -> Path:
    file = tmp_path / "crossing.mission"
    file.write_text(MISSION, encoding="utf-8")
    return file


def codes(compiled: missionc.Compiled) -> list[str]:
    return [each.code.name for each in compiled.findings]


def test_a_backend_object_plans_and_its_plan_is_verified(mission: Path) -> None:
    compiled = missionc.compile(mission, backend=Straight(0.75))
    assert isinstance(compiled.outcome, missionc.Verified)
    assert compiled.outcome.plan.backend == "straight"
    assert "straight" not in BACKENDS


def test_a_rejected_plan_names_the_backend_that_returned_it(mission: Path) -> None:
    compiled = missionc.compile(mission, backend=Straight(0.1))
    assert isinstance(compiled.outcome, missionc.Unverified)
    assert codes(compiled) == ["MC570"]
    assert "`straight`" in compiled.findings[0].message


def test_a_backend_object_plans_no_mission_beyond_its_features(mission: Path) -> None:
    mission.write_text(MISSION + "minimize duration\n", encoding="utf-8")
    compiled = missionc.compile(mission, backend=Straight(0.75))
    assert codes(compiled) == ["MC401"]
    assert "`straight` cannot express `minimize duration`" in compiled.findings[0].message


def test_a_trace_of_the_wrong_shape_is_an_error_of_the_backend(mission: Path) -> None:
    mission.write_text(MISSION.replace("cart[1]", "cart[2]").replace("(0.5, 1)", "(0.5, 1), (0.5, 1.5)"))
    with pytest.raises(ExtensionError, match=r"`straight` returned a `position` of the shape \(1, 5, 2\)"):
        missionc.compile(mission, backend=Straight(0.75))


def test_a_backend_object_has_a_name_of_its_own(mission: Path) -> None:
    clashing = Straight(0.75)
    clashing.name = "smt"
    with pytest.raises(ExtensionError, match="the name `smt` of the backend is taken"):
        missionc.compile(mission, backend=clashing)
    with pytest.raises(ExtensionError, match="MC410: the backend `None` cannot be used: a backend is an object"):
        missionc.compile(mission, backend=object())  # type: ignore[arg-type]


def test_an_installed_backend_is_asked_if_it_is_named(
    mission: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with package(tmp_path / "site", "idle_robots", {GROUP: {"idle": "idle_robots:BACKEND"}}, BACKEND):
        assert main(["compile", str(mission), "--backend", "idle", "-o", str(tmp_path / "out")]) == 4
        assert "idle plans nothing" in capsys.readouterr().err
        mission.write_text(MISSION + "solve with idle\n", encoding="utf-8")
        checked = missionc.check(mission)
        assert checked.ok
        assert checked.choice is not None
        assert checked.choice.engines == ("idle",)
        assert main(["extensions"]) == 0
        assert capsys.readouterr().out.split() == ["idle", "backend", "idle_robots", "1.0", "ready"]
    assert [each.code.name for each in missionc.check(mission).findings] == ["MC206"]


@pytest.mark.parametrize(
    ("code", "entry", "expected", "says"),
    [
        ("import no_such_module\n", "idle_robots:BACKEND", "MC410", "the module `no_such_module` is missing"),
        ("INTERFACE = 1\n1 / 0\n", "idle_robots:BACKEND", "MC410", "ZeroDivisionError at idle_robots.py:2"),
        ("INTERFACE = 1\n", "idle_robots:BACKEND", "MC410", "has no attribute 'BACKEND'"),
        ("INTERFACE = 1\nBACKEND = 3\n", "idle_robots:BACKEND", "MC410", "a backend is an object"),
        (BACKEND.replace('"idle"', '"lazy"'), "idle_robots:BACKEND", "MC410", "its `name` is not `idle`"),
        (BACKEND.replace("INTERFACE = 1", "INTERFACE = 2"), "idle_robots:BACKEND", "MC412", "declares interface 2"),
        (BACKEND.replace("INTERFACE = 1", ""), "idle_robots:BACKEND", "MC412", "declares no `INTERFACE`"),
        (BACKEND.replace("return NotFound", "1 / 0  #"), "idle_robots:BACKEND", "MC413", "= division by zero"),
        (BACKEND.replace("return NotFound", "1 / 0  #"), "idle_robots:BACKEND", "MC413", "Error at idle_robots.py:11"),
        (BACKEND.replace("return NotFound", "exit(3)  #"), "idle_robots:BACKEND", "MC413", "SystemExit at idle_robots"),
        ("INTERFACE = 1\nexit(0)\n", "idle_robots:BACKEND", "MC410", "SystemExit at idle_robots.py:2"),
        ("INTERFACE = 1\n)\n", "idle_robots:BACKEND", "MC410", "SyntaxError at idle_robots.py:2"),
    ],
)
def test_a_backend_that_cannot_be_used_has_a_code(
    code: str, entry: str, expected: str, says: str, mission: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with package(tmp_path / "site", "idle_robots", {GROUP: {"idle": entry}}, code):
        assert main(["compile", str(mission), "--backend", "idle", "-o", str(tmp_path / "out")]) == 1
        said = capsys.readouterr().err
        assert f"error[{expected}]" in said
        assert says in said
        assert "Traceback" not in said
        listed = main(["extensions"])
        assert listed == (0 if expected == "MC413" else 1)


def test_a_name_that_two_packages_provide_is_refused(
    mission: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    entries = {GROUP: {"idle": "idle_robots:BACKEND"}}
    with (
        package(tmp_path / "site", "idle_robots", entries, BACKEND),
        package(tmp_path / "other", "idle_copy", entries),
    ):
        assert main(["check", str(mission)]) == 0
        mission.write_text(MISSION + "solve with idle\n", encoding="utf-8")
        assert main(["check", str(mission)]) == 1
        assert "error[MC411]: the backend `idle` is provided by `idle_copy` 1.0 and by `idle_robots` 1.0" in (
            capsys.readouterr().err
        )
        assert main(["extensions"]) == 1


def test_a_built_in_name_cannot_be_taken(mission: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    entries = {GROUP: {"smt": "idle_robots:BACKEND"}, "missionc.commands": {"check": "idle_robots:BACKEND"}}
    with package(tmp_path / "site", "idle_robots", entries, BACKEND):
        assert main(["compile", str(mission), "-o", str(tmp_path / "out")]) == 1
        assert "error[MC411]: the backend `smt` of `idle_robots` 1.0 has the same name as a built-in" in (
            capsys.readouterr().err
        )


def test_a_command_of_an_extension_is_listed_and_run(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    code = (
        'import click\n\nINTERFACE = 1\n\n\n@click.command()\ndef tea():\n    """Make tea."""\n    click.echo("tea")\n'
    )
    with package(tmp_path / "site", "tea_robots", {"missionc.commands": {"tea": "tea_robots:tea"}}, code):
        assert main(["tea"]) == 0
        assert main(["--help"]) == 0
        assert "Make tea." in capsys.readouterr().out


def test_a_check_of_built_in_words_reads_no_metadata(mission: Path) -> None:
    installed.cache_clear()
    assert missionc.check(mission).ok
    assert installed.cache_info().currsize == 0


def test_an_outcome_that_is_none_is_an_error_of_the_backend(mission: Path) -> None:
    class Empty(Straight):
        def plan(self, mission: Mission, kernel: Kernel, options: Options, budget: Budget) -> Outcome:
            return None  # type: ignore[return-value]

    with pytest.raises(ExtensionError, match="`straight` returned neither `Planned`"):
        missionc.compile(mission, backend=Empty(1.0))


def outcome_of(mission: Path, outcome: object) -> missionc.Compiled:
    """The compilation with a backend that returns a value."""
    backend = Straight(0.75)
    backend.plan = lambda *_: outcome  # type: ignore[method-assign, assignment, return-value]
    return missionc.compile(mission, backend=backend)


def test_a_claim_that_no_plan_exists_is_undecided_unless_the_compiler_proves_it(mission: Path) -> None:
    compiled = outcome_of(mission, Impossible(("arrive",), "the gate is shut", Report()))
    assert codes(compiled) == ["MC607"]
    claim = "the backend `straight` reports that no plan exists with `arrive`; not verified: the gate is shut"
    assert claim in compiled.findings[0].notes
    assert "--solver" not in str(compiled.findings[0].help)


@pytest.mark.parametrize(
    ("outcome", "says"),
    [
        (Impossible(("depart",), "", Report()), "`depart`, which is no requirement"),
        (NotFound("tired", "tired", Report()), "no `Reason`: `'tired'`"),  # type: ignore[arg-type]
        (NotFound(Reason.SOLVER, 3, Report()), "a `statement` that is no text"),  # type: ignore[arg-type]
        (NotFound(Reason.SOLVER, "", None), "without a `Report`"),  # type: ignore[arg-type]
        (NotFound(Reason.SOLVER, "", Report(sizes=(("nodes", "few"),))), "failed: ValueError"),  # type: ignore[arg-type]
        (Planned(Trace(Seconds(1.0), [[]], [[]], []), Report()), "`position` is no array of floats"),  # type: ignore[arg-type]
        (Planned(None, Report()), "without a `Trace`"),  # type: ignore[arg-type]
    ],
)
def test_an_outcome_of_wrong_values_is_an_error_of_the_backend(outcome: Outcome, says: str, mission: Path) -> None:
    with pytest.raises(ExtensionError) as raised:
        outcome_of(mission, outcome)
    assert raised.value.code is EXTENSION_FAILED
    assert says in str(raised.value)


@pytest.mark.parametrize(
    ("member", "value", "says"),
    [
        ("name", None, "its name needs lower-case letters"),
        ("name", "My Backend", "its name needs lower-case letters"),
        ("features", [Feature.DISTANCE], "its `features` are no `frozenset`"),
        ("options", frozenset({"speed"}), "its `options` are no `frozenset` of names of `Options`"),
        ("plan", lambda mission: None, "failed: TypeError"),
    ],
)
def test_a_wrong_member_of_a_backend_object_is_named(member: str, value: object, says: str, mission: Path) -> None:
    backend = Straight(0.75)
    setattr(backend, member, value)
    with pytest.raises(ExtensionError, match=says):
        missionc.compile(mission, backend=backend)


def test_an_object_with_the_members_of_a_backend_is_one(mission: Path) -> None:
    duck = SimpleNamespace(name="duck", features=frozenset(), plan=Straight(0.75).plan)
    assert isinstance(missionc.compile(mission, backend=duck).outcome, missionc.Verified)  # type: ignore[arg-type]


def test_an_object_of_the_class_of_an_installed_backend_replaces_it(mission: Path, tmp_path: Path) -> None:
    with package(tmp_path / "site", "idle_robots", {GROUP: {"idle": "idle_robots:BACKEND"}}, BACKEND):
        own = importlib.import_module("idle_robots").Idle()
        assert codes(missionc.compile(mission, backend=own)) == ["MC607"]
        other = Straight(0.75)
        other.name = "idle"
        taken = (
            "the name `idle` of the backend is taken by `idle_robots` 1.0\n  help: give it another name, or uninstall"
        )
        with pytest.raises(ExtensionError, match=taken):
            missionc.compile(mission, backend=other)


def test_an_error_in_a_command_is_one_of_its_package(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    code = "import click\n\nINTERFACE = 1\n\n\n@click.command()\ndef tea():\n    {}['water']\n"
    with package(tmp_path / "site", "tea_robots", {"missionc.commands": {"tea": "tea_robots:tea"}}, code):
        assert main(["tea"]) == 1
        reported = capsys.readouterr().err
        assert "error[MC413]: the command `tea` of `tea_robots` 1.0 failed: KeyError at tea_robots.py:8" in reported
        assert "Traceback" not in reported
        monkeypatch.setenv("MISSIONC_TRACEBACK", "1")
        assert main(["tea"]) == 1
        assert "Traceback (most recent call last)" in capsys.readouterr().err


def test_a_manifest_names_the_packages_that_were_used_and_verify_names_an_absent_one(
    mission: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "out"
    with source_package(EXAMPLE, tmp_path / "site"):
        text = MISSION.replace("region goal = box (2.5, 0) to (4, 2)", "beacon a = (3, 1)")
        mission.write_text(text.replace("s] goal", "s] between(a, a, 1 m)"), encoding="utf-8")
        assert main(["compile", str(mission), "--backend", "darts", "-o", str(folder)]) == 0
        assert json.loads((folder / "manifest.json").read_text())["versions"]["carts"] == "1.0"
        assert main(["verify", str(folder)]) == 0
    assert main(["verify", str(folder)]) != 0
    assert "needs a package that is not installed: `carts` 1.0" in capsys.readouterr().err


def test_all_names_for_packages_are_listed() -> None:
    assert set(dir(extension)) == {name for names in extension.HOMES.values() for name in names}
    assert all(getattr(extension, name) is not None for name in dir(extension))


def test_a_backend_may_find_nothing(mission: Path) -> None:
    class Tired(Straight):
        def plan(self, mission: Mission, kernel: Kernel, options: Options, budget: Budget) -> Outcome:
            return NotFound(Reason.SOLVER, "tired", Report())

    assert codes(missionc.compile(mission, backend=Tired(1.0))) == ["MC607"]


SIMULATOR = """
import numpy as np

from missionc.extension import Flown, sample_times, setpoints

INTERFACE = 1


def fly(pieces, seconds):
    times = sample_times(seconds)
    told = np.stack([setpoints(own, times) for own in pieces])
    position, velocity = (np.moveaxis(told[:, rows], 1, 2)[None] for rows in (slice(0, 3), slice(3, 6)))
    return Flown(times, position, velocity, np.zeros(position.shape[:3]))
"""
EXPORT = """
from missionc.extension import Exported, Format

INTERFACE = 1
FORMAT = Format("names", "the agents' names", lambda flight: Exported({"NAME": b"cart"}))
"""


def test_an_export_of_an_extension_is_written_verified_and_listed(
    mission: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = str(tmp_path / "out")
    entries = {"missionc.exports": {"names": "name_robots:FORMAT"}}
    with package(tmp_path / "site", "name_robots", entries, EXPORT.replace("NAME", "names.txt")):
        assert main(["compile", str(mission), "-o", folder, "--export", "names"]) == 0
        assert (tmp_path / "out" / "export" / "names" / "names.txt").read_bytes() == b"cart"
        assert main(["verify", folder]) == 0
        assert main(["export", folder, "names", "-o", str(tmp_path / "more")]) == 0
        assert main(["export", "--list"]) == 0
        assert "names        the agents' names" in capsys.readouterr().out
        (tmp_path / "out" / "export" / "names" / "names.txt").write_bytes(b"cars")
        assert main(["verify", folder]) == 5
    assert main(["verify", folder]) == 5
    assert "unknown export" in capsys.readouterr().err
    (tmp_path / "out" / "export" / "names" / "names.txt").write_bytes(b"cart")
    with package(tmp_path / "bad", "name_robots", entries, EXPORT.replace("NAME", "../names.txt")):
        assert main(["export", folder, "names", "-o", str(tmp_path / "further")]) == 1
        assert (
            "error[MC413]: the export `names` of `name_robots` 1.0 wrote something other than a file"
            in capsys.readouterr().err
        )
    assert not (tmp_path / "further").exists()


def test_a_simulator_of_an_extension_flies_and_its_record_verifies(
    mission: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = str(tmp_path / "out")
    entries = {"missionc.simulators": {"exact": "exact_robots:fly"}}
    assert main(["compile", str(mission), "-o", folder]) == 0
    assert main(["simulate", folder, "--engine", "exact"]) == 2
    with package(tmp_path / "site", "exact_robots", entries, SIMULATOR):
        assert main(["simulate", folder, "--engine", "exact"]) == 0
        assert "1 agent for 4 s, engine exact, seed 0\n" in capsys.readouterr().out
        assert main(["verify", folder]) == 0
        assert main(["simulate", folder, "--engine", "exact", "--trials", "2"]) == 2
    lost = SIMULATOR.replace("Flown(times, position", "Flown(times, position * np.nan")
    with package(tmp_path / "lost", "exact_robots", entries, lost):
        assert main(["simulate", folder, "--engine", "exact"]) == 1
        assert "returned a `Flown` with values that are not finite" in capsys.readouterr().err
    with package(tmp_path / "bad", "exact_robots", entries, SIMULATOR.replace("[None] for", " for")):
        assert main(["simulate", folder, "--engine", "exact"]) == 1
        assert (
            "error[MC413]: the simulator `exact` of `exact_robots` 1.0 returned no `Flown`" in capsys.readouterr().err
        )


def test_whatever_an_example_package_registers_can_be_used(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with source_package(EXAMPLE, tmp_path / "site"):
        assert main(["extensions", "--format", "json"]) == 0
        listed = json.loads(capsys.readouterr().out)["extensions"]
    assert {each["kind"] for each in listed} == {each.noun for each in Kind}
    assert {each["state"] for each in listed} == {"ready"}


def test_the_page_builds_the_example_package_file_by_file() -> None:
    page = (EXAMPLE.parents[1] / "docs" / "extending.md").read_text(encoding="utf-8")
    shown = {block.info.split()[1]: block.body for block in blocks(page) if is_file(block)}
    files = [path for path in EXAMPLE.rglob("*") if path.suffix in (".py", ".toml")]
    assert shown == {str(path.relative_to(EXAMPLE)): path.read_text(encoding="utf-8") for path in files}


@pytest.mark.slow
def test_pip_installs_the_example_package_without_a_network(tmp_path: Path) -> None:
    pytest.importorskip("hatchling")
    words = ["install", "--quiet", "--no-deps", "--no-build-isolation", "--no-index", "--target", str(tmp_path)]
    subprocess.run([sys.executable, "-m", "pip", *words, str(EXAMPLE)], check=True)
    with on_path(tmp_path):
        assert [each.name for each in installed()] == [
            "darts",
            "elbow",
            "between",
            "deep",
            "car",
            "crane",
            "waypoints",
            "late",
            "margins",
        ]
