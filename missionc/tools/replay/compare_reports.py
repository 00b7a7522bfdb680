"""Report that compares two plans of one mission: both on one page, with one time line.

in   two Reverified
out  the page's bytes, or the reason why they are plans of different missions
says MC716
"""

from __future__ import annotations

from itertools import zip_longest
from pathlib import Path

from missionc.base.diagnostics.code import NOT_ONE_MISSION
from missionc.base.diagnostics.model import Diagnostic
from missionc.compiler.provenance import texts
from missionc.output.report.report_html import report
from missionc.tools.replay.read_folder import OutputFolder
from missionc.tools.replay.rebuild.rebuild_documents import plotted
from missionc.tools.replay.reverify import Reverified


def compare_reports(first: Reverified, second: Reverified) -> bytes | Diagnostic:
    """Report page of two plans, or the finding that they belong to different missions.

    Args:
        first, second: re-verified, readable folders, shown as A and B.
    """
    assert first.opened is not None
    assert second.opened is not None
    different = _difference(first.opened, second.opened)
    if different:
        return Diagnostic(
            NOT_ONE_MISSION,
            f"`{first.folder}` and `{second.folder}` are plans of different missions",
            None,
            notes=(different,),
            help="name two plan folders of the same mission",
        )
    plots = [plotted(each.opened, each.certificate) for each in (first, second) if each.opened and each.certificate]
    names = _short_names(first.folder, second.folder)
    return report(plots[0], compared=(names, plots[1]))


def _short_names(first: Path, second: Path) -> tuple[str, str]:
    """Names of two folders for display; their paths if the names are equal."""
    if first.name != second.name:
        return first.name, second.name
    return str(first), str(second)


def _difference(first: OutputFolder, second: OutputFolder) -> str:
    """First difference between the missions of two folders in words; empty if they are equal."""
    if first.mission.name != second.mission.name:
        return f"the first is a plan of `{first.mission.name}`, the second of `{second.mission.name}`"
    ours, theirs = texts(first.checked), texts(second.checked)
    # The mission's own file may have had another name.
    if [name for name, _ in ours[1:]] != [name for name, _ in theirs[1:]]:
        return f"the first has the files {_listed(ours)}, the second {_listed(theirs)}"
    for (name, text), (_, changed) in zip(ours, theirs, strict=True):
        for number, (one, other) in enumerate(zip_longest(text.splitlines(), changed.splitlines()), 1):
            if one != other:
                return f"line {number} of `{name}`: {_quoted(one)} in the first, {_quoted(other)} in the second"
    return _of_values(first, second)


def _of_values(first: OutputFolder, second: OutputFolder) -> str:
    """Difference in the length or the agents of two missions, which command-line values cause.

    Empty if there is none.
    """
    ours, theirs = first.mission, second.mission
    if (ours.step, ours.steps) != (theirs.step, theirs.steps):
        times = [f"{mission.steps} steps of {mission.step:g} s" for mission in (ours, theirs)]
        return f"the first lasts {times[0]}, the second {times[1]}"
    names = [", ".join(agent.name for agent in mission.agents) for mission in (ours, theirs)]
    return "" if names[0] == names[1] else f"the first has the agents {names[0]}, the second {names[1]}"


def _listed(files: tuple[tuple[str, str], ...]) -> str:
    return ", ".join(f"`{name}`" for name, _ in files)


def _quoted(line: str | None) -> str:
    return "nothing" if line is None else f"`{' '.join(line.split())}`"
