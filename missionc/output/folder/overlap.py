"""Overlap of output paths: with what a command reads, with each other, with the folder that it runs in.

in   the outputs by their flags, the paths that are read
out  the refusal of the first that would, if any

    says MC701 MC702
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from missionc.base.diagnostics.model import Diagnostic
from missionc.output.folder.ownership import cannot_write, exists, reason, shown


@dataclass(frozen=True, slots=True)
class WrittenPath:
    """A file that is to be written, or a folder that is to be written as a whole; ``flag`` names another."""

    flag: str
    path: Path
    folder: bool = False


def overlapping(outputs: Sequence[WrittenPath], inputs: Iterable[Path]) -> Diagnostic | None:
    """What forbids the first of these outputs; absent where they can be written side by side.

    A folder that is written as a whole may not hold what is read, nor another
    output, nor the folder in which the command runs; no output may be what is
    read, or lie in a folder that is read.
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
    """Whether a path leads into a folder, or to it, by whatever names and links; neither has to be there."""
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
    """Whether two paths lead to one file; one below another file, which can be none, is not the same."""
    return within(one, other) and within(other, one)


def _elsewhere(output: WrittenPath) -> str:
    return f"another {'folder' if output.folder else 'file'} with `{output.flag}`"
