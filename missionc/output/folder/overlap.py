"""Overlap of output paths with inputs, with each other, and with the working directory.

in   the outputs by their flags, the input paths
out  a finding for the first overlap, if any

    says MC701 MC702
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from pathlib import Path

from missionc.base.diagnostics.model import Diagnostic
from missionc.base.late_dataclass import Record
from missionc.output.folder.ownership import cannot_write, exists, reason, shown


class WrittenPath(Record):
    """File that will be written, or folder that will be written completely.

    ``flag`` is the option that changes the path.
    """

    flag: str
    path: Path
    folder: bool = False


def overlapping(outputs: Sequence[WrittenPath], inputs: Iterable[Path]) -> Diagnostic | None:
    """Diagnostic of the first output that overlaps with another path, or None.

    A folder that is written completely must not contain an input, another output or the working directory; no output
    may be an input or be in an input folder.
    """
    inputs = tuple(inputs)
    for number, output in enumerate(outputs):
        others = [other for place, other in enumerate(outputs) if place != number]
        try:
            refused = _of_inputs(output, inputs) or _of_outputs(output, others)
        except (OSError, ValueError) as error:
            refused = cannot_write(output.path, reason(error), f"another with `{output.flag}`")
        if refused:
            return refused
    return None


def within(path: Path, folder: Path) -> bool:
    """Return whether a path is a folder or lies inside it, after resolving links.

    Neither path needs to exist.
    """
    inner, outer = os.path.realpath(path), os.path.realpath(folder)
    if inner == outer or inner.startswith(os.path.join(outer, "")):
        return True
    if not os.path.exists(outer):
        return False
    return any(
        os.path.exists(each) and os.path.samefile(each, outer) for each in (inner, *map(str, Path(inner).parents))
    )


def _of_inputs(output: WrittenPath, inputs: Sequence[Path]) -> Diagnostic | None:
    if output.folder and os.path.exists(output.path) and within(Path.cwd(), output.path):
        return exists(output.path, " and is the working directory of this command")
    for read in inputs:
        if output.folder and read.is_dir() and _same(output.path, read):
            return exists(output.path, " and is an input of this command")
        if output.folder and within(read, output.path):
            return exists(output.path, f" and contains `{shown(read)}`, an input of this command")
        if _same(output.path, read):
            return cannot_write(output.path, "it is an input of this command", _elsewhere(output))
        if read.is_dir() and within(output.path, read):
            where = f"it is in `{shown(read)}`, an input of this command"
            return cannot_write(output.path, where, _elsewhere(output))
    return None


def _of_outputs(output: WrittenPath, others: Iterable[WrittenPath]) -> Diagnostic | None:
    for other in others:
        if other.folder and within(output.path, other.path):
            return cannot_write(output.path, f"it is in `{shown(other.path)}`, another output", _elsewhere(output))
        if not output.folder and not other.folder and _same(output.path, other.path):
            return cannot_write(output.path, f"`{other.flag}` names the same file", _elsewhere(output))
    return None


def _same(one: Path, other: Path) -> bool:
    """Return whether two paths denote the same file; a path below another file is never the same."""
    return within(one, other) and within(other, one)


def _elsewhere(output: WrittenPath) -> str:
    return f"another {'folder' if output.folder else 'file'} with `{output.flag}`"
