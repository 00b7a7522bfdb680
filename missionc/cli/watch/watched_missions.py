"""Watched missions: checked again when one of their files is saved, those they include among them."""

from __future__ import annotations

import time
from collections.abc import Callable
from datetime import datetime
from typing import NoReturn

import click

from missionc.cli.watch.file_changes import EVERY, Saves
from missionc.compiler.front_end import Checked


class Missions:
    """Args:
    files: of the missions.
    check: says what there is to find in them now.
    """

    def __init__(self, files: list[str], check: Callable[[], list[Checked]]) -> None:
        self._files, self._check, self._saves = files, check, Saves()
        self._saves.watch(files)

    def checked(self) -> list[Checked]:
        """What there is to find in them. A file that is new among them was read before it was watched: once more."""
        while True:
            checked = self._check()
            included = [name for each in checked for name in (*(source.name for source in each.sources), *each.unread)]
            if not self._saves.watch([*self._files, *included]):
                return checked

    def saved(self) -> bool:
        """Whether there is a save to look at."""
        return self._saves.saved()


def watch_missions(missions: Missions, answer: Callable[[list[Checked]], object]) -> NoReturn:
    """Answers for the missions as they are, and again after every save; until it is interrupted."""
    click.echo("watching the missions and their included files; Ctrl-C stops")
    while True:
        answer(missions.checked())
        while not missions.saved():
            time.sleep(EVERY)
        heading()


def heading() -> None:
    """What stands between two rounds."""
    click.echo(f"\n{datetime.now():%H:%M:%S} file saved")
