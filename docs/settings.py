"""The tables in docs/settings.md, generated from the settings of the backends.

python docs/settings.py writes the tables into the page
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields
from itertools import groupby
from pathlib import Path

from missionc.backends.clot.run.presets import PRESETS
from missionc.backends.setting import Setting, settings_of
from missionc.backends.settings import DEFAULTS, written

PAGE = Path(__file__).with_name("settings.md")
BEGIN = "<!-- made by docs/settings.py -->\n"


def page(text: str) -> str:
    """Page with the current tables."""
    return text.partition(BEGIN)[0] + BEGIN + "\n".join(tables())


def tables() -> Iterator[str]:
    """Lines with one table for each group, and one for the presets."""
    for backend, value in DEFAULTS.items():
        for group, settings in groupby(settings_of(value), key=lambda each: each.group):
            about = (type(getattr(value, group)).__doc__ or "").split("\n")[0]
            yield f"\n## {backend}.{group}\n\n{about}\n"
            yield "| setting | default | meaning | range |\n|---|---|---|---|"
            yield from (_row(each) for each in settings)
    yield "\n## Presets\n\nValues of `clot.search` and `clot.transport` that a preset uses instead of the defaults."
    yield "\n| preset | values |\n|---|---|"
    for name, preset in PRESETS.items():
        if preset.local:
            changed = [*_changed("search", preset.search), *_changed("transport", preset.transport)]
            yield f"| `{name}` | {', '.join(changed)} |"
    yield ""


def _row(setting: Setting) -> str:
    name = setting.name.rpartition(".")[2]
    allowed = setting.range.removeprefix("a whole number from ").removeprefix("a number from ")
    allowed = allowed.replace(" to 1,000,000,000,000", " or more").replace(" to ", "–")
    return f"| `{name}` | {written(setting.default)} | {setting.says} | {allowed} |"


def _changed(group: str, value: object) -> Iterator[str]:
    default = getattr(DEFAULTS["clot"], group)
    for each in fields(default):
        own = getattr(value, each.name)
        if own != getattr(default, each.name):
            yield f"`{group}.{each.name}` {own.name.lower() if hasattr(own, 'name') else written(own)}"


if __name__ == "__main__":
    PAGE.write_text(page(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
