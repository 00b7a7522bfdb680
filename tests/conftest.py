"""What every test shares: the switch that rewrites golden pages, and one Hypothesis profile."""

from __future__ import annotations

import copy
import gc
import os
import pickle
import re
import shutil
import sys
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from hypothesis import HealthCheck, settings

if TYPE_CHECKING:
    from missionc.flight.simulation.default_engine import Flown

ROOT = Path(__file__).resolve().parent.parent
COVERS = ("missionc.backends.cover.refute", "missionc.backends.cover.refute")
"""What asks covers, in more and more cells: whether a mission can be, and how long it takes at least."""

GARBAGE = 50_000, 50, 50
"""After how many objects garbage is looked for: seldom, since few tests leave much behind."""

gc.disable()  # until all tests are loaded

# Compiling all tests takes longer than one of them: it is done once, as in `make check`, whatever the environment says.
sys.dont_write_bytecode = False
os.environ["PYTHONDONTWRITEBYTECODE"] = ""

# The tests run in parallel processes; a thread pool in each of them (torch's) would only make them wait for each other.
os.environ.setdefault("OMP_NUM_THREADS", "1")

settings.register_profile(
    "missionc",
    derandomize=True,
    deadline=None,
    database=None,
    max_examples=100,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.function_scoped_fixture],
)
settings.load_profile("missionc")


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--update-golden", action="store_true", help="rewrite the outputs pinned in Markdown pages; review the diff"
    )


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Without a GPU, a browser, or Node.js, the tests that need one are skipped, and listed as such."""
    needy = [item for item in items if item.get_closest_marker("gpu")]
    if needy:
        torch = pytest.importorskip("torch")
        if not torch.cuda.is_available():
            for item in needy:
                item.add_marker(pytest.mark.skip(reason="there is no GPU"))
    absent = "chromium" if not shutil.which("chromium") else "playwright" if not find_spec("playwright") else ""
    if absent:
        for item in items:
            if item.get_closest_marker("browser"):
                item.add_marker(pytest.mark.skip(reason=f"there is no {absent}"))
    if not (shutil.which("node") and shutil.which("npm")):
        for item in items:
            if item.get_closest_marker("node"):
                item.add_marker(pytest.mark.skip(reason="there is no Node.js with npm"))


def pytest_collection_finish() -> None:
    """What is loaded by now stays until the end: no collection of garbage walks through it again."""
    gc.freeze()
    gc.set_threshold(*GARBAGE)
    gc.enable()


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """Leave out files without the tests of `-k "test_a or test_b"`: importing all files takes longer than one test."""
    names = config.getoption("keyword").lower()
    if collection_path.suffix != ".py" or not re.fullmatch(r"test_\w+( or test_\w+)*", names):
        return None
    text = f"{collection_path.name}\n{collection_path.read_text(encoding='utf-8')}".lower()
    return None if any(name in text for name in names.split(" or ")) else True


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    """The browser that the tests of a file share."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as driver:
        started = driver.chromium.launch(executable_path=shutil.which("chromium"), args=["--no-sandbox"])
        yield started
        started.close()


@pytest.fixture
def update_golden(request: pytest.FixtureRequest) -> bool:
    return bool(request.config.getoption("--update-golden"))


@pytest.fixture
def missions() -> Path:
    """The folder of real missions."""
    return ROOT / "missions"


@pytest.fixture
def roadmaps_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """Covers are not asked: what a backend says of its roadmaps is the answer."""
    monkeypatch.setattr("missionc.compiler.ask_cover.CoverSide.refusal", lambda *_: None)


@pytest.fixture
def coarse_covers(monkeypatch: pytest.MonkeyPatch) -> None:
    """Covers are asked, in a few cells alone: for tests of what is said where they refuse nothing."""
    for module in COVERS:
        monkeypatch.setattr(f"{module}.CELLS", (8,))


@pytest.fixture(scope="module")
def coarse_covers_throughout() -> Iterator[None]:
    """``coarse_covers`` for a whole file, whose tests share what was compiled once."""
    with pytest.MonkeyPatch.context() as patched:
        for module in COVERS:
            patched.setattr(f"{module}.CELLS", (8,))
        yield


_FLOWN: dict[bytes, Flown] = {}


@pytest.fixture
def flown_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """The simulator remembers: the same flight, in the same air, is flown once for all tests that ask for this."""
    from missionc.flight.simulation import trials

    fly = trials.fly

    def remembered(*arguments: object, **named: object) -> Flown:
        asked = pickle.dumps((arguments, sorted(named.items())))
        if asked not in _FLOWN:
            _FLOWN[asked] = fly(*arguments, **named)  # type: ignore[arg-type]
        return copy.deepcopy(_FLOWN[asked])

    monkeypatch.setattr(trials, "fly", remembered)
