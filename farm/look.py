"""One trial after the other, until the time is over.

in   a seed, a journal, how long; where findings are kept
out  what was found; a line of the journal for each trial, a file for each finding that is new
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from farm import found_files
from farm.journal import Journal, Line
from farm.own_process import carried_out
from farm.shrink import shrunk
from farm.trial import MISSION, Answer, Case, Fault, Kind
from farm.trials import trial as trial_of

SHRINKING = 90.0
"""Seconds on the wall that a finding is made smaller."""

Tell = Callable[[str], None]
Trial = Callable[[int, int], tuple[Kind, Case]]


@dataclass(frozen=True, slots=True)
class Find:
    """Something new, and where it is kept."""

    fault: Fault
    path: Path


def look(
    journal: Journal, seed: int, seconds: float, kept: Path, commit: str, tell: Tell, trial: Trial = trial_of
) -> list[Find]:
    """Carry out trials from the first that the journal has not, until so many seconds are over.

    Args:
        kept: the folder for what is found.
        commit: of the tree, for the journal.
        trial: the kind and the case of a seed and a number.
    """
    end, found = time.monotonic() + seconds, list[Find]()
    number = journal.next_trial(seed)
    while time.monotonic() < end:
        kind, case = trial(seed, number)
        answer = carried_out(kind, case)
        line = Line(seed, number, kind.name, answer.outcome, round(answer.seconds, 3), commit)
        if answer.fault:
            line = replace(line, signature=answer.fault.signature)
            tell(f"trial {number}, {kind.name}: {answer.fault.signature}")
            if answer.fault.signature not in journal.signatures:
                found.append(kept_small(kept, kind, case, answer.fault, (seed, number)))
                tell(f"  saved in {found[-1].path}")
        journal.add(line)
        number += 1
    return found


def kept_small(
    folder: Path, kind: Kind, case: Case, fault: Fault, trial: tuple[int, int], seconds: float = SHRINKING
) -> Find:
    """A finding made small and written into a folder."""
    small = smaller(kind, case, fault, seconds)
    return Find(fault, found_files.keep(folder, kind, small, fault, trial))


def smaller(kind: Kind, case: Case, fault: Fault, seconds: float = SHRINKING) -> Case:
    """The case with the smallest mission found that shows the same fault; in one text, if that does.

    Where it is not about a text: with one of what its settings list, if that does.
    """

    def shows(candidate: Case) -> bool:
        return same(carried_out(kind, candidate), fault)

    if not kind.of_text:
        alone = (replace(case, settings=settings) for settings in _one_each(case.settings))
        return next((each for each in alone if shows(each)), case)
    whole = in_one_text(case)
    case = whole if whole != case and shows(whole) else case
    return case.with_text(shrunk(case.files[MISSION], lambda text: shows(case.with_text(text)), seconds))


def _one_each(settings: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """Settings with one of what they list."""
    for key, value in settings.items():
        if isinstance(value, list) and len(value) > 1:
            yield from ({**settings, key: [each]} for each in value)


def same(answer: Answer, fault: Fault) -> bool:
    return answer.fault is not None and answer.fault.signature == fault.signature


def in_one_text(case: Case) -> Case:
    """A case whose missions are put where they are included."""
    text, rest = case.files[MISSION], dict(case.files)
    for name in case.files:
        line = f'include "{name}"\n'
        if name != MISSION and line in text:
            text = text.replace(line, rest.pop(name))
    return replace(case, files={**rest, MISSION: text})
