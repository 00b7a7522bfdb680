"""What a plan came from: the mission's files, and what of the command line changes the plan."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from missionc.backends.api import Options
from missionc.results import Checked

if TYPE_CHECKING:
    from missionc.emit import Option


def inputs(checked: Checked) -> tuple[tuple[str, bytes], ...]:
    """Every file of the mission, by its name relative to the mission's folder."""
    folder = Path(checked.file).parent
    return tuple(
        (Path(source.name).relative_to(folder).as_posix(), source.text.encode("utf-8")) for source in checked.sources
    )


def texts(checked: Checked) -> tuple[tuple[str, str], ...]:
    """The same files as text."""
    return tuple((name, content.decode("utf-8")) for name, content in inputs(checked))


def given(checked: Checked, options: Options) -> tuple[tuple[str, Option], ...]:
    """What of the command line changes the plan."""
    named = [("solver", options.solver)]
    if checked.choice is not None and checked.choice.backend != "smt":
        named.append(("preset", options.preset))
        named.append(("device", options.device))
        named.extend([("samples", str(options.samples))] if options.samples is not None else [])
    named.extend([("margin", repr(options.margin))] if options.margin is not None else [])
    named.extend([("stretch", repr(options.stretch))] if options.stretch != 1 else [])
    named.extend([("vehicle", checked.vehicle)] if checked.vehicle else [])
    return (*named, *((f"-D {name}", text) for name, text in sorted(checked.overrides.items())))


def asked_for(exports: tuple[str, ...]) -> tuple[tuple[str, Option], ...]:
    """What of the command line changes nothing but which files there are."""
    return (("export", ",".join(dict.fromkeys(exports))),) if exports else ()
