"""Predicates of extensions: their words in missions, their margins in every view, and what is refused of them."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import missionc
from missionc.backends.cover.may_labels import margin_range
from missionc.base.diagnostics.code import EXTENSION_FAILED
from missionc.base.extensions import ExtensionError
from missionc.base.source import Source
from missionc.base.trace import Trace
from missionc.base.units import Seconds
from missionc.cli.app import main
from missionc.frontend.checks.place_margins import margin_at
from missionc.frontend.resolve.called_predicates import CALLED
from missionc.geometry.plain_floats import Place
from missionc.ir import Mission, Predicate
from missionc.ir.kernel.nodes import Atom
from missionc.ir.kernel.walk import postorder
from missionc.ir.language.margins.predicate_margins import margin, of_states
from missionc.ir.predicates import PlacePredicate
from missionc.tools.language_server.completion import completion
from missionc.tools.language_server.hover import hover
from missionc.verification.impossibility.intervals import IntervalView
from tests.support.installed_packages import package, source_package
from tests.support.open_texts import marked

EXAMPLE = Path(__file__).resolve().parents[3] / "examples" / "extension"
MISSION = """mission corridor
time step 1 s, horizon 8 s
world (0, 0) to (10, 6)
beacon dock = (2, 3)
beacon gate = (8, 3)
team cart[2] { radius 0.2 m  dynamics single_integrator(speed <= 1 m/s)  start at (0.5, 2), (0.5, 4) }
require through: every cart: eventually[0, 8 s] between(dock, gate, 7 m)
"""
NEAR = """
from dataclasses import dataclass
from typing import ClassVar

from missionc.extension import PlacePredicate

INTERFACE = 1


@dataclass(frozen=True)
class Near(PlacePredicate):
    parameters: ClassVar = ("a length",)
    says: ClassVar = "the agent is near the origin"
    example: ClassVar = "near(2 m)"
    slope: ClassVar = 1

    reach: float

    def value(self, xp, place):
        return self.reach - xp.sqrt(place[..., 0] ** 2 + place[..., 1] ** 2)
"""


@pytest.fixture
def carts(tmp_path: Path) -> Iterator[None]:
    with source_package(EXAMPLE, tmp_path / "site"):
        yield


def findings(text: str) -> list[tuple[str, str]]:
    return [(each.code.name, each.message) for each in missionc.check(Source("corridor.mission", text)).findings]


def predicate_of(text: str) -> tuple[Mission, PlacePredicate]:
    checked = missionc.check(Source("corridor.mission", text))
    assert checked.ok, checked.findings
    nodes = postorder(goal.formula for goal in checked.valid_kernel.goals)
    atom = next(node for node in nodes if isinstance(node, Atom))
    assert isinstance(atom.predicate, PlacePredicate)
    return checked.valid_mission, atom.predicate


@pytest.mark.usefixtures("carts", "roadmaps_alone")
def test_a_mission_with_a_predicate_of_an_extension_goes_the_whole_way(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file, folder = tmp_path / "corridor.mission", str(tmp_path / "out")
    file.write_text(MISSION, encoding="utf-8")
    assert main(["explain", str(file)]) == 0
    assert "satisfies `between(dock, gate, 7 m)`" in capsys.readouterr().out
    assert main(["compile", str(file), "--emit", "kernel"]) == 0
    assert "between(dock, gate, 7 m)" in capsys.readouterr().out
    for backend in ("smt", "darts"):
        assert main(["compile", str(file), "--backend", backend, "-o", folder, "--force"]) == 0
        assert main(["verify", folder]) == 0
        assert main(["monitor", str(file), f"{folder}/plan.json", "--continuous"]) == 0


@pytest.mark.slow
@pytest.mark.usefixtures("carts")
def test_two_goals_that_no_motion_satisfies_are_refused_by_a_proof_that_verifies(tmp_path: Path) -> None:
    text = MISSION.replace("8 s", "2 s").replace("cart[2]", "cart[1]").replace("(0.5, 2), (0.5, 4)", "(0.3, 3)")
    text += "require off: every cart: always[0, 2 s] not between(dock, gate, 9 m)\n"
    compiled = missionc.compile(Source("corridor.mission", text), options=missionc.Options(certify=True))
    assert isinstance(compiled.outcome, missionc.Impossible)
    assert compiled.outcome.scope is missionc.Scope.MISSION
    for name, content in compiled.files.items():
        (tmp_path / "out" / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / "out" / name).write_bytes(content)
    assert main(["verify", str(tmp_path / "out")]) == 0


@pytest.mark.usefixtures("carts")
def test_the_margin_is_the_same_in_every_view_and_within_the_range_of_a_box() -> None:
    mission, predicate = predicate_of(MISSION)
    generator = np.random.default_rng(7)
    places = generator.uniform((0, 0), (10, 6), (200, 2))
    dock, gate = np.array((2.0, 3.0)), np.array((8.0, 3.0))
    right = (7 - np.linalg.norm(places - dock, axis=1) - np.linalg.norm(places - gate, axis=1)) / 2
    assert of_states(predicate, mission, 0, places, np.zeros_like(places)) == pytest.approx(right)
    plain = [margin_at(mission, predicate, mission.agents[0], (Place(place), None)) for place in places.tolist()]
    assert plain == pytest.approx(right)
    for reach in (0.0, 0.3, 2.0):
        boxes = places - reach, places + reach
        inside = places[:, None] + generator.uniform(-reach, reach, (200, 20, 2))
        values = of_states(predicate, mission, 0, inside, np.zeros_like(inside))
        for bounds in (
            margin_range(predicate, mission, {0: boxes}),
            predicate.margin(IntervalView(mission, {0: boxes})),
        ):
            assert np.all(bounds.low <= values.min(axis=1))
            assert np.all(bounds.high >= values.max(axis=1))


@pytest.mark.usefixtures("carts")
@pytest.mark.parametrize(
    ("call", "code", "says"),
    [
        ("between(dock, gate)", "MC104", "`between` takes one beacon and one beacon and a length; found 2"),
        ("between(dock, gate, 7 s)", "MC201", "a length"),
        ("between(dock, cart, 7 m)", "MC104", "expected a beacon"),
        ("between(dock, gate, 5 m)", "MC210", "the beacons are 6 m apart, so no place is within 5 m"),
        ("betwen(dock, gate, 7 m)", "MC101", "unknown predicate `betwen`"),
        ("between", "MC101", "`between` needs"),
    ],
)
def test_a_wrong_argument_is_reported_at_its_place(call: str, code: str, says: str) -> None:
    found = findings(MISSION.replace("between(dock, gate, 7 m)", call))
    assert [name for name, _ in found if name != "MC103"] == [code]
    assert any(says in message for _, message in found), found


@pytest.mark.usefixtures("carts")
def test_an_editor_offers_and_explains_the_predicate() -> None:
    head, _, _ = MISSION.rpartition("require")
    offered = [item.label for item in completion(*marked(f"{head}require r: every cart: |"))]
    assert "between" in offered
    assert {"dock", "gate"} <= {item.label for item in completion(*marked(f"{head}require r: every cart: between(|"))}
    said = hover(*marked(MISSION.replace("between(", "betw|een(")))
    assert said is not None
    assert "The distances from two beacons add up to at most a length" in str(said.contents)


def test_a_predicate_that_is_not_installed_is_unknown() -> None:
    assert ("MC101", "unknown predicate `between`") in findings(MISSION)


@pytest.mark.parametrize(
    ("before", "after", "says"),
    [
        ("class Near(PlacePredicate)", "class Near", "extends `PlacePredicate`"),
        ("def value", "def worth", "its class has no `value`"),
        ('"near(2 m)"', '"far(2 m)"', "its `example` does not begin with `near(`"),
        ('("a length",)', '("a colour",)', "`a colour` among `parameters`"),
        ('"near(2 m)"', '"near(2 m"', "`example` is a call"),
        ("slope: ClassVar = 1", "slope: ClassVar = 0", "its `slope` is `0`"),
        ("slope: ClassVar = 1", 'slope: ClassVar = "1"', "its `slope` is `'1'`"),
        ("slope: ClassVar = 1", "slope = property(lambda self: self.reach)", "its `slope` is a property"),
        ("    slope: ClassVar = 1\n", "", "its `slope` is missing"),
        ("    reach: float\n", "", "its class has 0 fields and 1 `parameters`"),
        ("reach", "region", "without a name of the base class"),
    ],
)
def test_a_class_that_is_no_predicate_is_refused(before: str, after: str, says: str, tmp_path: Path) -> None:
    code, entries = NEAR.replace(before, after), {"missionc.predicates": {"near": "near_robots:Near"}}
    with package(tmp_path / "site", "near_robots", entries, code):
        found = findings(MISSION.replace("between(dock, gate, 7 m)", "near(7 m)"))
        refused = [message for name, message in found if name == "MC410"]
        assert len(refused) == 1
        assert says in refused[0]


def test_a_slope_that_is_too_small_is_found_on_a_trace(tmp_path: Path) -> None:
    code = NEAR.replace("return self.reach -", "return self.reach - 3 *")
    with package(tmp_path / "site", "near_robots", {"missionc.predicates": {"near": "near_robots:Near"}}, code):
        mission, predicate = predicate_of(MISSION.replace("between(dock, gate, 7 m)", "near(7 m)"))
        position = np.zeros((2, 9, 2))
        position[:, :, 0] = np.arange(9)
        trace = resting_trace(position)
        with pytest.raises(ExtensionError, match=r"a value that changes by 3 over 1 m; its slope is 1"):
            margin(predicate, mission, trace)
        position[:] = 1.0
        position[0, 3] = np.nan  # not recorded
        assert np.isnan(margin(predicate, mission, resting_trace(position))[0, 3])


VALUE = "return self.reach - xp.sqrt(place[..., 0] ** 2 + place[..., 1] ** 2)"
PLACES = np.array(((0.5, 2.0), (3.0, 4.0), (9.0, 5.0)))


def margin_in(library: str, predicate: Predicate, mission: Mission) -> object:
    """The margin at ``PLACES``, or at the first of them."""
    if library == "plain":
        return margin_at(mission, predicate, mission.agents[0], (Place(PLACES[0]), None))
    if library == "intervals":
        return predicate.margin(IntervalView(mission, {0: (PLACES, PLACES)}))
    xp = pytest.importorskip(library)
    return of_states(predicate, mission, 0, xp.asarray(PLACES), 0 * xp.asarray(PLACES), xp=xp)


@pytest.mark.parametrize("library", ["plain", "numpy", "torch", "intervals"])
@pytest.mark.parametrize(
    ("value", "says"),
    [
        ("return 0 * place[..., 0] + float('nan')", "has the value nan at (0.5, 2)"),
        ("return place[..., 0] / float('inf') + float('inf')", "has the value inf at (0.5, 2)"),
        ("return place[..., 0] > 1", "no number"),
        ("return None", "`None`"),
        ("return place", ""),
        ("return place[..., 0] + next(STATE)", "has two values at (0.5, 2)"),
        ("1 / 0", "failed: ZeroDivisionError at near_robots.py:"),
        ("exit(0)", "failed: SystemExit at near_robots.py:"),
    ],
)
def test_values_that_cannot_be_used_are_found_in_every_library(
    value: str, says: str, library: str, tmp_path: Path
) -> None:
    code, entries = NEAR.replace(VALUE, value), {"missionc.predicates": {"near": "near_robots:Near"}}
    with package(tmp_path / "good", "near_robots", entries, NEAR):
        mission, _ = predicate_of(MISSION.replace("between(dock, gate, 7 m)", "near(7 m)"))
    with package(tmp_path / "site", "near_robots", entries, f"import itertools\nSTATE = itertools.count()\n{code}"):
        predicate = CALLED["near"].meant(7.0)  # type: ignore[misc]
        with pytest.raises(ExtensionError) as raised:
            margin_in(library, predicate, mission)
    assert raised.value.code is EXTENSION_FAILED
    assert f"the predicate `near` of `near_robots` 1.0 {says}" in str(raised.value) or says in raised.value.message


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("goal", ["eventually[0, 8 s] near(7 m)", "always[0, 8 s] not near(7 m)"])
def test_a_value_that_is_nan_somewhere_proves_nothing(goal: str, tmp_path: Path) -> None:
    code = NEAR.replace("return self", "import numpy as np\n        return np.sqrt(2 - place[..., 0]) + 0 * self")
    with package(tmp_path / "site", "near_robots", {"missionc.predicates": {"near": "near_robots:Near"}}, code):
        source = Source("corridor.mission", MISSION.replace("eventually[0, 8 s] between(dock, gate, 7 m)", goal))
        with pytest.raises(ExtensionError, match="has the value nan at"):
            missionc.compile(source, backend="smt")


def test_an_error_of_a_constructor_is_reported_at_the_call(tmp_path: Path) -> None:
    code = NEAR + "\n    def __post_init__(self):\n        {}['radio']\n"
    with package(tmp_path / "site", "near_robots", {"missionc.predicates": {"near": "near_robots:Near"}}, code):
        text = MISSION.replace("between(dock, gate, 7 m)", "near(7 m)")
        found = next(each for each in missionc.check(Source("m.mission", text)).findings if each.code.name == "MC413")
    assert found.primary is not None
    assert found.primary.span.text == "near(7 m)"
    assert found.notes == ("'radio'",)


def resting_trace(position: np.ndarray) -> Trace:
    return Trace(Seconds(1.0), position, np.zeros_like(position), np.zeros(position.shape[:2]))
