"""The loop of trials until the time is over.

in   a seed, a journal, a duration; the folder of findings
out  the findings; a line of the journal for each trial, a file for each new finding
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
"""Wall-clock seconds for shrinking a finding."""

Tell = Callable[[str], None]
Trial = Callable[[int, int], tuple[Kind, Case]]


@dataclass(frozen=True, slots=True)
class Find:
    """New finding with its file."""

    fault: Fault
    path: Path


def look(
    journal: Journal, seed: int, seconds: float, kept: Path, commit: str, tell: Tell, trial: Trial = trial_of
) -> list[Find]:
    """Carry out trials from the first new one on for ``seconds``.

    Args:
        kept: folder of findings.
        commit: commit of the tree, for the journal.
        trial: function from a seed and a number to a kind and a case.
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
    """Shrink a finding and write it to a folder."""
    small = smaller(kind, case, fault, seconds)
    return Find(fault, found_files.keep(folder, kind, small, fault, trial))


def smaller(kind: Kind, case: Case, fault: Fault, seconds: float = SHRINKING) -> Case:
    """Case with the smallest mission found that has the same fault; in a single text, if possible.

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
    """Settings with one element of each list."""
    for key, value in settings.items():
        if isinstance(value, list) and len(value) > 1:
            yield from ({**settings, key: [each]} for each in value)


def same(answer: Answer, fault: Fault) -> bool:
    return answer.fault is not None and answer.fault.signature == fault.signature


def in_one_text(case: Case) -> Case:
    """Case with includes replaced by their missions."""
    text, rest = case.files[MISSION], dict(case.files)
    for name in case.files:
        line = f'include "{name}"\n'
        if name != MISSION and line in text:
            text = text.replace(line, rest.pop(name))
    return replace(case, files={**rest, MISSION: text})
