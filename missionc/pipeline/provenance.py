"""Provenance of what is written: the mission's files, and what of the command line changes the plan."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from missionc.backends.api import Options
from missionc.output.folder.file_names import (
    MANIFEST,
    NEAR_MISS,
    PROOF,
    input_name,
)
from missionc.pipeline.results import Checked, Compiled

if TYPE_CHECKING:
    from missionc.output.output_files import Option


def inputs(checked: Checked) -> tuple[tuple[str, bytes], ...]:
    """Every file of the mission, by its name relative to the mission's folder."""
    folder = Path(checked.file).parent
    return tuple((input_name(source.name, folder), source.text.encode("utf-8")) for source in checked.sources)


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


def with_manifest(compiled: Compiled) -> Compiled:
    """A compilation that ended without a plan, with a manifest of the files that it leaves, if it leaves any."""
    files, mission = dict(compiled.files), compiled.checked.mission
    if not files or mission is None:
        return compiled
    from missionc.output.folder.manifest import without_plan  # loads what writes plans

    missed = compiled.explained.near_miss.files if compiled.explained and compiled.explained.near_miss else ()
    holds = NEAR_MISS if len(missed) == len(files) else PROOF
    return replace(compiled, listing=((MANIFEST, without_plan(mission.name, holds, files).encode()),))
