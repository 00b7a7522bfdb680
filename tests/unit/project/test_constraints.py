"""What an installation with ``constraints.txt`` brings is what this was tested with, down to the last package."""

from __future__ import annotations

from importlib.metadata import distribution
from pathlib import Path

import pytest

pytest.importorskip("packaging")

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

CONSTRAINTS = Path(__file__).resolve().parents[3] / "constraints.txt"
BUILDS = {"missionc", "pip", "setuptools", "wheel"}
"""What is no dependency, but builds and installs them."""


def needed(name: str, *extras: str) -> dict[str, str]:
    """The version of every installed package that a package and its extras need here, by canonical name."""
    found: dict[str, str] = {}
    looked_at: set[tuple[str, str]] = set()
    left = [(name, extra) for extra in ("", *extras)]
    while left:
        package, extra = left.pop()
        if (canonicalize_name(package), extra) in looked_at:
            continue
        looked_at.add((canonicalize_name(package), extra))
        installed = distribution(package)
        found[canonicalize_name(package)] = installed.version.partition("+")[0]
        for requirement in map(Requirement, installed.requires or ()):
            if requirement.marker is None or requirement.marker.evaluate({"extra": extra}):
                left += [(requirement.name, more) for more in ("", *requirement.extras)]
    return found


def test_every_package_that_the_extra_dev_brings_has_its_version_in_the_constraints() -> None:
    lines = [line for line in CONSTRAINTS.read_text(encoding="utf-8").splitlines() if not line.startswith("#")]
    pinned = {canonicalize_name(name): version for name, _, version in (line.partition("==") for line in lines)}
    brought = {name: version for name, version in needed("missionc", "dev").items() if name not in BUILDS}
    assert len(brought) > 100
    assert {name: pinned.get(name) for name in brought} == brought
    assert [line for line in lines if line != line.strip() or line.count("==") != 1] == []
