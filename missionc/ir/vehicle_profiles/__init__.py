"""Vehicle profiles of the compiler: one TOML file per vehicle in this folder.

A file contains parameters of ``ir.FIGURES`` by name, each as a text with its unit, ``speed = "1 m/s"``, or a range
``"0.3..2 m"``. ``like = "NAME"`` inherits the other parameters from another profile. Parameters that no file sets have
the values of ``plain``.
"""

from __future__ import annotations

import re
import tomllib
from dataclasses import replace
from functools import cache
from pathlib import Path

from missionc.base.units import UNITS, Dimension
from missionc.ir import FIGURES, PLAIN, Band, Figure, Vehicle

_FIGURE = re.compile(r"(?:(?P<low>[0-9.]+)\.\.)?(?P<high>[0-9]+(?:\.[0-9]+)?)(?: (?P<unit>\S+))?")


@cache
def profiles() -> dict[str, Vehicle]:
    """Vehicle profiles by name: ``plain``, then the files in alphabetical order.

    Raises:
        ValueError: a file is not a valid profile.
    """
    folder = Path(__file__).parent
    written = {path.stem: tomllib.loads(path.read_text(encoding="utf-8")) for path in sorted(folder.glob("*.toml"))}
    found = {PLAIN.name: PLAIN}
    for name in sorted(written, key=lambda name: "like" in written[name]):
        found[name] = read_profile(name, written[name], found)
    return {name: found[name] for name in (PLAIN.name, *written)}


def read_profile(name: str, figures: dict[str, object], known: dict[str, Vehicle]) -> Vehicle:
    """Vehicle that the parameters of a profile file describe.

    ``known`` are the profiles that ``like`` may name, which use no ``like`` themselves.

    Raises:
        ValueError: a parameter is unknown, has no unit or is out of range.
    """
    like = figures.get("like", PLAIN.name)
    if like not in known:
        raise ValueError(f"{name}.toml: unknown profile `{like}` in `like`")
    values = {key: _value(name, key, text) for key, text in figures.items() if key != "like"}
    return replace(known[str(like)], name=name, **values)  # type: ignore[arg-type]


def _value(name: str, key: str, text: object) -> float | int | Band:
    figure = FIGURES.get(key)
    if figure is None:
        raise ValueError(f"{name}.toml: unknown figure `{key}`; use one of {', '.join(FIGURES)}")
    match = _FIGURE.fullmatch(text) if isinstance(text, str) else None
    if (
        match is None
        or bool(match["low"]) != (figure.relation == "..")
        or _dimension(match["unit"]) != figure.dimension
    ):
        raise ValueError(
            f'{name}.toml: `{key}` must be {figure.dimension.value} with its unit, for example "{example(figure)}"'
        )
    factor = UNITS[match["unit"]][1] if match["unit"] else 1.0
    high = float(match["high"]) * factor
    if figure.relation == "..":
        low = float(match["low"]) * factor
        if low >= high:
            raise ValueError(f"{name}.toml: bounds of `{key}` reversed: {text}")
        if figure.around and not low < 1 < high:
            raise ValueError(f"{name}.toml: `{key}` must contain 1: {text}")
        return Band(low, high)
    if (figure.above and high == 0) or (figure.whole and high % 1):
        raise ValueError(f"{name}.toml: `{key}` is out of range: {text}")
    return int(high) if figure.whole else high


def _dimension(unit: str | None) -> Dimension | None:
    return Dimension.NUMBER if unit is None else UNITS.get(unit, (None, 1.0))[0]


def example(figure: Figure) -> str:
    """Example value of a vehicle parameter as text, with unit."""
    unit = next((f" {unit}" for unit, known in UNITS.items() if known == (figure.dimension, 1.0)), "")
    low = "0" if figure.around else "1"
    return (f"{low}..2" if figure.relation == ".." else "1") + unit
