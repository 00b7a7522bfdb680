"""What the pages about the backends say of the code is so: names, pipelines, weights, who can express what."""

from __future__ import annotations

import re
from dataclasses import asdict
from pathlib import Path

import pytest

from missionc.backends.clot.settings import Spare, Weights
from missionc.backends.features import Feature
from missionc.backends.registry import BACKENDS
from tests.support.names_in_pages import ROOT, dotted, is_defined, is_there, module_files, modules, paths

FOLDER = ROOT / "missionc" / "backends"
DOCS = ROOT / "docs"
PAGES = {DOCS / "transport.md": FOLDER / "clot", DOCS / "roadmaps.md": FOLDER / "smt"}
"""Each page, with the package it is about."""
SHARED = (
    FOLDER,
    *(ROOT / "missionc" / room for room in ("planning", "planning/progression", "geometry", "ir/lower")),
)
"""What the pages may name beside it."""
TEXTS = {page: page.read_text(encoding="utf-8") for page in PAGES}
LANGUAGE = (DOCS / "language.md").read_text(encoding="utf-8")
FIELD = {
    "roadmaps.md": (
        "PRM",
        "time-expanded graph",
        "negation normal form",
        "unsat core",
        "CEGAR",
        "lazy constraint",
        "prioritized planning",
        "reservation table",
        "cost-to-go",
        "totalizer",
        "presolve",
        "Plaisted",
    ),
    "transport.md": ("Levenberg", "convex quadratic program", "entropic transport", "Sinkhorn", "Gaussian process"),
}
"""What somebody who knows the field searches for."""

pages = pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)


@pages
def test_a_name_of_the_page_is_in_the_module_it_says(page: Path) -> None:
    names = dotted(TEXTS[page])
    assert [name for name in names if not any(is_defined(name, home) for home in (PAGES[page], *SHARED))] == []
    assert len(names) > 30


@pages
def test_a_path_of_the_page_is_there(page: Path) -> None:
    named = paths(TEXTS[page])
    assert [path for path in named if not is_there(path)] == []
    assert len(named) > 3


@pages
def test_a_file_of_the_page_is_in_its_package(page: Path) -> None:
    known = modules(PAGES[page])
    assert [name for name in module_files(TEXTS[page]) if name.removesuffix(".py") not in known] == []


@pages
def test_the_pipeline_says_where_each_stage_is(page: Path) -> None:
    rows = re.findall(r"^\| [^|]+ \| [^|]+ \| (.+) \|$", pipeline(TEXTS[page]), re.MULTILINE)
    assert len(rows) > 8
    for place in rows:
        assert dotted(place), f"{place} names no module and what is in it"
        assert all(any(is_defined(name, home) for home in (PAGES[page], *SHARED)) for name in dotted(place))


@pages
def test_the_terms_of_the_field_are_on_the_page(page: Path) -> None:
    text = " ".join(TEXTS[page].lower().split())
    assert [term for term in FIELD[page.name] if term.lower() not in text] == []


def test_every_module_of_the_roadmap_backend_is_on_its_page() -> None:
    page = DOCS / "roadmaps.md"
    named = {name.partition(".")[0] for name in dotted(TEXTS[page])}
    named |= {name.removesuffix(".py") for name in module_files(TEXTS[page])}
    named |= set(re.findall(r"`([a-z_]+)`", TEXTS[page]))
    assert modules(PAGES[page]).keys() - named == set()


def pipeline(text: str) -> str:
    """The rows of a page's table of stages."""
    return text.split("| stage | task of the stage | code |\n|---|---|---|\n", 1)[1].split("\n\n", 1)[0]


@pytest.mark.parametrize("figures", [Weights(), Spare()], ids=["Weights", "Spare"])
def test_the_page_has_the_weights_that_count(figures: Weights | Spare) -> None:
    table = TEXTS[DOCS / "transport.md"].split(f"| `{type(figures).__name__}` |", 1)[1].split("\n\n", 1)[0]
    said = {name: float(value) for name, value in re.findall(r"\| `(\w+)` \| ([\d.]+) \|", table)}
    assert said == asdict(figures)


def test_the_table_of_backends_says_what_each_offers() -> None:
    table = LANGUAGE.split("### Backends\n", 1)[1].split("\n#", 1)[0]
    _, *names = (
        word.strip(" `") for word in next(re.finditer(r"^\| the mission has (.*) \|$", table, re.M))[0].split("|")[1:-1]
    )
    assert names == list(BACKENDS.built_in)
    rows = dict(re.findall(r"^\| (.*?) \| ((?:yes|no) .*) \|$", table, re.M))
    assert set(rows) == {feature.value for feature in Feature}
    for feature in Feature:
        said = dict(zip(names, rows[feature.value].split(" | "), strict=True))
        assert said == {name: "yes" if feature in spec.features else "no" for name, spec in BACKENDS.items_built_in()}
