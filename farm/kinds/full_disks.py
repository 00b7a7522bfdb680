"""A command with a full disk: it must report a code, and leave its target unchanged.

The disk is a small one that is mounted for the trial alone; where that may not be, no file may grow beyond a size.
"""

from __future__ import annotations

import resource
from pathlib import Path

import numpy as np

from farm import small_disk
from farm.kinds.killed_processes import TARGETS, nothing_beside, prepared, state, words_of
from farm.trial import MISSION, Broken, Case, Kind
from missionc.base.diagnostics.code import CANNOT_WRITE
from missionc.cli.exit_status import Status
from tests.support.every_command import codes, said
from tests.support.small_missions import SMALL

PAGE = 4096
"""Bytes of the blocks that fill such a disk."""
COMMANDS = tuple(command for command in TARGETS if command != "sweep")


def draw(generator: np.random.Generator) -> Case:
    text = SMALL.replace("drone[2]", f"drone[{generator.integers(1, 4)}]")
    command, share = str(generator.choice(COMMANDS)), float(generator.random())
    return Case({MISSION: text}, {"command": command, "share": share, "disk": bool(generator.random() < 0.8)})


def carry_out(case: Case, folder: Path) -> str:
    """Run the command once with space, to measure its size, and once with less."""
    wishes = case.settings
    command, homes = wishes["command"], (folder / "whole", folder / "full")
    homes[1].mkdir()
    why = small_disk.mount(homes[1]) if wishes["disk"] else ""
    if why:
        return f"skipped, {why}"
    whole, full = (prepared(command, case, home) for home in homes)
    before, held = state(full), _room(homes[1])
    status, roomy = said(*words_of(command, homes[0]))
    assert status in (Status.DONE, Status.VIOLATED), roomy
    why = _take_room(homes, held, wishes["share"], wishes["disk"])
    if why:
        return f"skipped, {why}"
    status, document = said(*words_of(command, homes[1]))
    about = f"{command}: {status} {document}"
    if status not in (Status.DONE, Status.VIOLATED, Status.MISSION_ERRORS):
        raise Broken(f"{command} status", "On a full disk, a command ends with a documented exit status.", about)
    if status == Status.MISSION_ERRORS and set(codes(document)) != {CANNOT_WRITE.name}:
        raise Broken(f"{command} code", f"A full disk is reported as {CANNOT_WRITE.name}.", about)
    nothing_beside(homes[1], f"{command} leaves", about)
    if status == Status.MISSION_ERRORS:
        if state(full) != before:
            raise Broken(
                f"{command} half", "A file that could not be replaced is unchanged.", f"{about}\n{state(full)}"
            )
        return "full"
    if state(full).keys() != state(whole).keys():
        raise Broken(f"{command} less", "All written files are complete.", f"{about}\n{state(full)}")
    return "had room"


def _take_room(homes: tuple[Path, Path], held: int, share: float, disk: bool) -> str:
    """Leave the second folder a part of the space used in the first.

    Returns the reason if that is impossible.
    """
    if disk:
        # During the replacement of a folder, both exist.
        room = held + int(share * (_room(homes[0]) + PAGE))
        return small_disk.resize(homes[1], -(-room // PAGE) * PAGE + PAGE)
    largest = max(path.stat().st_size for path in homes[0].rglob("*") if path.is_file())
    size = int(share * largest)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))
    return ""


def _room(folder: Path) -> int:
    """Bytes of whole pages, including one page for each folder."""
    sizes = [path.stat().st_size if path.is_file() else 1 for path in [folder, *folder.rglob("*")]]
    return sum(-(-size // PAGE) * PAGE for size in sizes)


FULL_DISKS = Kind("full_disks", "a command on a full disk", draw, carry_out, 240.0, of_text=False)
