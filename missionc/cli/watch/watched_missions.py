"""Watched missions, which are checked again when one of their files or included files is saved."""

from __future__ import annotations

import time
from collections.abc import Callable
from datetime import datetime
from typing import NoReturn

import click

from missionc.cli.watch.file_changes import EVERY, Saves
from missionc.compiler.front_end import Checked


class Missions:
    """Missions and their watched files.

    Args:
        files: files of the missions.
        check: function that checks them.
    """

    def __init__(self, files: list[str], check: Callable[[], list[Checked]]) -> None:
        self._files, self._check, self._saves = files, check, Saves()
        self._saves.watch(files)

    def checked(self) -> list[Checked]:
        """Check the missions and watch their included files; repeated if one of these was not watched before."""
        while True:
            checked = self._check()
            included = [name for each in checked for name in (*(source.name for source in each.sources), *each.unread)]
            if not self._saves.watch([*self._files, *included]):
                return checked

    def saved(self) -> bool:
        """Return whether a file was saved since the last check."""
        return self._saves.saved()


def watch_missions(missions: Missions, answer: Callable[[list[Checked]], object]) -> NoReturn:
    """Process missions now and after every save, until interrupted.

    Args:
        missions: watched missions.
        answer: function that processes the checked missions.
    """
    click.echo("watching the missions and their included files; Ctrl-C stops")
    while True:
        answer(missions.checked())
        while not missions.saved():
            time.sleep(EVERY)
        heading()


def heading() -> None:
    """Print a line with the time, which separates two rounds."""
    click.echo(f"\n{datetime.now():%H:%M:%S} file saved")
