"""What docs/transport.md and docs/language.md say of the code is so: names, weights, who can express what."""

from __future__ import annotations

import ast
import re
from dataclasses import asdict
from pathlib import Path

import pytest

from missionc.backends.clot.weights import Spare, Weights
from missionc.backends.features import Feature
from missionc.backends.offers import OFFERS

ROOT = Path(__file__).resolve().parents[2]
CLOT = ROOT / "missionc" / "backends" / "clot"
PAGE = (ROOT / "docs" / "transport.md").read_text(encoding="utf-8")
LANGUAGE = (ROOT / "docs" / "language.md").read_text(encoding="utf-8")
MODULES = {path.stem: path for path in CLOT.rglob("*.py") if path.stem != "__init__"}
NAMES = sorted({name for name in re.findall(r"`([a-z_]+(?:\.\w+)+)`", PAGE) if name.split(".")[0] in MODULES})
NAMES = [name for name in NAMES if not name.endswith(".py")]
FILES = sorted({*re.findall(r"`([a-z_]+\.py)`", PAGE)})
PATHS = sorted({*re.findall(r"`((?:missionc|missions|bench)/[\w/.*]+)`", PAGE)})


def defined(body: list[ast.stmt]) -> dict[str, list[ast.stmt]]:
    """The names some statements define, each with the statements within it."""
    found: dict[str, list[ast.stmt]] = {}
    for each in body:
        match each:
            case ast.ClassDef(name=name, body=inner) | ast.FunctionDef(name=name, body=inner):
                found[name] = inner
            case ast.Assign(targets=[ast.Name(id=name)]) | ast.AnnAssign(target=ast.Name(id=name)):
                found[name] = []
    return found


@pytest.mark.parametrize("name", NAMES)
def test_a_name_of_the_page_is_in_the_module_it_says(name: str) -> None:
    module, *words = name.split(".")
    body = ast.parse(MODULES[module].read_text(encoding="utf-8")).body
    for word in words:
        there = defined(body)
        assert word in there
        body = there[word]


def test_the_page_names_many_places() -> None:
    assert len(NAMES) > 30
    assert len(PATHS) > 5


@pytest.mark.parametrize("path", [*(f"missionc/backends/clot/**/{name}" for name in FILES), *PATHS])
def test_a_path_of_the_page_is_there(path: str) -> None:
    assert list(ROOT.glob(path))


@pytest.mark.parametrize("figures", [Weights(), Spare()], ids=["Weights", "Spare"])
def test_the_page_has_the_weights_that_count(figures: Weights | Spare) -> None:
    table = PAGE.split(f"| `{type(figures).__name__}` |", 1)[1].split("\n\n", 1)[0]
    said = {name: float(value) for name, value in re.findall(r"\| `(\w+)` \| ([\d.]+) \|", table)}
    assert said == asdict(figures)


def test_the_table_of_backends_says_what_each_offers() -> None:
    table = LANGUAGE.split("### Backends\n", 1)[1].split("\n#", 1)[0]
    _, *names = (
        word.strip(" `") for word in next(re.finditer(r"^\| the mission has (.*) \|$", table, re.M))[0].split("|")[1:-1]
    )
    assert names == list(OFFERS)
    rows = dict(re.findall(r"^\| (a .*?|an .*?|unicycle .*?|dynamics .*?|`minimize .*?) \| (.*) \|$", table, re.M))
    assert set(rows) == {feature.value for feature in Feature}
    for feature in Feature:
        said = dict(zip(names, rows[feature.value].split(" | "), strict=True))
        assert said == {name: "yes" if feature in offer.features else "no" for name, offer in OFFERS.items()}
