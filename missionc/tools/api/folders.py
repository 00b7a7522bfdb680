"""Public functions that read plan folders: verify, simulate, export, report, plot and replan.

Each takes the path of a folder, or a result of ``compile``, which is written to a temporary folder first.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, TypeAlias

from missionc.base.diagnostics.model import Diagnostic
from missionc.base.limits import Limits
from missionc.base.units import Seconds
from missionc.compiler.described import described
from missionc.compiler.graphs import first_roadmaps, picture_of
from missionc.compiler.replan.request import Replanned
from missionc.compiler.results import Compiled
from missionc.flight.simulation.disturbance import Disturbance
from missionc.flight.simulation.trial_bounds import ENGINES, LARGEST_SEED, MOST_FLIGHTS, QUADROTOR
from missionc.flight.simulation.trials import Trial
from missionc.output.export.formats import FORMATS
from missionc.output.plot.figure_request import MAP, ROADMAP, FigureRequest
from missionc.tools.api.disturbances import DISTURBANCES, amounts_of
from missionc.tools.api.export_folder import FolderExport, export_folder
from missionc.tools.api.replan_folder import replan_folder
from missionc.tools.replay.read_folder import OutputFolder, read_folder
from missionc.tools.replay.render_report import compare_reports, render_report
from missionc.tools.replay.reverify import Reverified, reverify, reverify_refusal
from missionc.tools.replay.simulate_folder import Simulated
from missionc.tools.replay.simulate_folder import simulate as simulate_folder

PlanLike: TypeAlias = "str | Path | Compiled"
"""Path of a plan folder, or a result of ``compile``."""


def verify(plan: PlanLike, *, limits: Limits | None = None) -> Reverified:
    """Verify a plan folder from its files alone, without planning.

    Args:
        plan: path of a plan folder, or a result of ``compile``; the folder has a plan or a proof that none exists.
        limits: maximum sizes of the folder's files; the defaults of ``Limits`` if None.

    Returns:
        The findings and the certificate that was computed from the files.
    """
    with _on_disk(plan) as folder:
        return reverify_refusal(folder, limits or Limits()) or reverify(folder, limits)


@described(DISTURBANCES)
def simulate(
    plan: PlanLike,
    *,
    trials: int = 1,
    seed: int = 0,
    engine: str = QUADROTOR,
    limits: Limits | None = None,
    **disturbances: Any,
) -> Simulated:
    """Simulate the flight of a plan with a vehicle and its controller, and evaluate the mission on the flown path.

    Args:
        plan: path of a plan folder, or a result of ``compile``.
        trials: number of flights.
        seed: random seed.
        engine: ``quadrotor``, or the name of another installed simulator, which flies once without disturbances.
        limits: maximum sizes of the folder's files; the defaults of ``Limits`` if None.

    Raises:
        TypeError: a disturbance is unknown.
        ValueError: a value is out of its range.
    """
    amounts, lost = amounts_of("simulate", disturbances)
    if engine not in ENGINES:
        raise ValueError(f"unknown engine {engine!r}; use one of {', '.join(ENGINES)}")
    for name, value, least, most in (("trials", trials, 1, MOST_FLIGHTS), ("seed", seed, 0, LARGEST_SEED)):
        if not least <= value <= most:
            raise ValueError(f"`{name}` must be a number from {least} to {most}, not {value!r}")
    if engine != QUADROTOR and (trials > 1 or disturbances):
        raise ValueError(f"{engine} simulates one flight without disturbances; omit `trials` and the disturbances")
    trial = Trial(engine, trials, Disturbance(**amounts, lose=lost), seed)
    with _on_disk(plan) as folder:
        return simulate_folder(folder, trial, limits)


def export(plan: PlanLike, *forms: str, poses: Path | None = None, limits: Limits | None = None) -> FolderExport:
    """Verify a plan folder, and export its flight in other formats.

    Args:
        plan: path of a plan folder, or a result of ``compile``.
        forms: format names, as ``missionc export --list`` prints them.
        poses: file of measured positions, from which the agents take off; None for the starts of the mission.
        limits: maximum sizes of the folder's files; the defaults of ``Limits`` if None.

    Raises:
        ValueError: a format is unknown.
    """
    for form in forms:
        if form not in FORMATS:
            raise ValueError(f"unknown export format `{form}`; use one of {', '.join(FORMATS)}")
    with _on_disk(plan) as folder:
        return export_folder(folder, forms, poses, limits or Limits())


def report(plan: PlanLike, other: PlanLike | None = None, *, limits: Limits | None = None) -> bytes:
    """Build the HTML report of a plan folder from its files.

    Args:
        plan: path of a plan folder, or a result of ``compile``.
        other: second plan of the same mission, shown for comparison on the same page.
        limits: maximum sizes of the folder's files; the defaults of ``Limits`` if None.

    Returns:
        The page as bytes.

    Raises:
        ValueError: a folder cannot be read, or the plans belong to different missions; the message begins with the
            code.
    """
    with _on_disk(plan) as folder:
        first = reverify(folder, limits)
        if other is None:
            return _made(first, render_report(first) or b"")
        with _on_disk(other) as another:
            second = reverify(another, limits)
            unread = next((each for each in (first, second) if not (each.opened and each.certificate)), None)
            return _made(unread or first, b"" if unread else compare_reports(first, second))


def _made(reverified: Reverified, page: bytes | Diagnostic) -> bytes:
    if page and not isinstance(page, Diagnostic):
        return page
    raise _error(page if isinstance(page, Diagnostic) else reverified.findings[0])


def plot(
    plan: PlanLike,
    kind: str = MAP,
    *,
    at: tuple[float, ...] = (),
    width: str = "",
    form: str = "svg",
    seed: int = 0,
    limits: Limits | None = None,
) -> bytes:
    """Draw a figure of a plan.

    Args:
        plan: path of a plan folder, or a result of ``compile``.
        kind: ``map``, ``roadmap``, ``robustness``, ``distances`` or ``timeline``.
        at: times of the maps, seconds; one map of the complete motion if empty.
        width: ``single`` or ``double``: one or two columns of a paper.
        form: file format: ``svg``, ``png`` or ``pdf``.
        seed: random seed of the roadmap to draw if the plan has none.
        limits: maximum sizes of the folder's files; the defaults of ``Limits`` if None.

    Returns:
        The figure as the bytes of a file.

    Raises:
        ValueError: there is no plan, or it cannot be drawn; the message begins with the code.
    """
    request = FigureRequest(kind, at, width)
    if isinstance(plan, Compiled):
        picture = picture_of(plan, request, form, seed)
    else:
        opened = read_folder(Path(plan), limits)
        if not isinstance(opened, OutputFolder):
            raise _error(opened[0])
        from missionc.output.plot.figures import figure  # loads matplotlib

        backend = str(opened.manifest.get("backend", ""))
        roadmaps = first_roadmaps(opened.checked, seed) if kind == ROADMAP else ()
        drawn = (opened.mission, opened.kernel, opened.trace, backend, form)
        picture = roadmaps if isinstance(roadmaps, Diagnostic) else figure(request, *drawn, roadmaps)
    if isinstance(picture, Diagnostic):
        raise _error(picture)
    return picture


def replan(
    plan: PlanLike,
    flown: str | Path,
    *,
    changed: str | Path | None = None,
    lost: tuple[str, ...] = (),
    slow: Mapping[str, float] | None = None,
    give_up: tuple[str, ...] = (),
    within: float = 3.0,
    seed: int = 0,
    exports: tuple[str, ...] = (),
    limits: Limits | None = None,
) -> Replanned:
    """Compute a new plan for the remaining part of a mission during its flight.

    Args:
        plan: path of a plan folder, or a result of ``compile``.
        flown: file of the recorded trace, from the start of the plan on.
        changed: file of declarations that replace those of the mission; None if nothing changed.
        lost: names of agents that no longer fly.
        slow: maximum speeds of slow agents, m/s, by name.
        give_up: names of requirements to drop.
        within: seconds until the start of the new plan.
        seed: random seed.
        exports: names of further file formats.
        limits: maximum sizes of the folder's files; the defaults of ``Limits`` if None.
    """
    patch = None if changed is None else Path(changed)
    rest = (lost, slow or {}, give_up, Seconds(within), seed, exports, limits or Limits())
    with _on_disk(plan) as folder:
        return replan_folder(folder, Path(flown), patch, *rest)


@contextmanager
def _on_disk(plan: PlanLike) -> Iterator[Path]:
    """Yield the folder of a plan, a temporary one for a result of ``compile``.

    Raises:
        TypeError: the plan is neither a path nor a result of ``compile``.
    """
    if isinstance(plan, str | Path):
        yield Path(plan)
        return
    if not isinstance(plan, Compiled):
        raise TypeError(
            f"expected the path of a plan folder or a result of `compile`, not {plan!r}; compile a mission first"
        )
    with TemporaryDirectory() as parent:
        folder = Path(parent) / "plan"
        plan.write(folder)
        yield folder


def _error(finding: Diagnostic) -> ValueError:
    return ValueError(f"{finding.code.name}: {finding.message}; {finding.help}")
