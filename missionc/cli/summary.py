"""Summaries of results: lines of text, and JSON documents."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import asdict
from typing import TYPE_CHECKING

from missionc.backends.api import Attempt, Impossible, NotFound, Report, Violation
from missionc.base.constraint import constraint_lines, constraint_records
from missionc.base.trace import counted, decimals, judgement_lines, solved_text
from missionc.base.units import Seconds
from missionc.cli import plan_summary
from missionc.compiler.relax.advice import explained_document, explained_lines
from missionc.compiler.results import Compiled, InvalidMission, Monitored, Verified
from missionc.frontend.resolve.resolve_files import file_lines, file_records
from missionc.frontend.resolve.resolve_quantities import SI
from missionc.frontend.resolve.show_ir import figures_of
from missionc.ir import FIGURES, Band, Mission, Vehicle

if TYPE_CHECKING:
    from missionc.output.documents.alternatives_json import AlternativeRow
    from missionc.tools.replay.reverify import Reverified
    from missionc.verification.certificate import Between, Certificate, Check, Delay

SHOWN = 5e-4
"""Smallest margin, in its unit, that is not rounded to 0 in a summary."""


def compiled_lines(compiled: Compiled, output: str, seconds: Seconds, verbose: bool) -> list[str]:
    """Lines of the summary of a compilation.

    Args:
        compiled: compilation.
        output: the written folder, or empty.
        seconds: duration of the compilation.
        verbose: whether to list every requirement, kind of check, engine, note and file.
    """
    mission = compiled.checked.mission
    outcome = compiled.outcome
    if mission is None:
        return []
    written = [f"output: {output}", *(folder_lines(compiled.files) if verbose else [])] if output else []
    if isinstance(outcome, Impossible | NotFound):
        best = outcome.best if isinstance(outcome, NotFound) else None
        candidate = attempt_lines(mission.name, best, mission.step) if best and verbose else []
        tried = _several(outcome.report) if verbose else []
        return [*tried, *candidate, *explained_lines(compiled), *written]
    if not isinstance(outcome, Verified):
        return []
    further = [
        *(_details(outcome, mission) if verbose else []),
        *alternative_lines([each.row for each in compiled.alternatives]),
        *(written if verbose else []),
    ]
    return plan_summary.plan_lines(outcome, mission, seconds, output, verbose, further)


def _details(outcome: Verified, mission: Mission) -> list[str]:
    """Lines of the complete summary: files, requirements, engines, notes, tightest check of each kind, delays."""
    certificate, solved = outcome.certificate, solved_text(outcome.plan.solved)
    return [
        *(["files read", *(f"  {line}" for line in file_lines(mission))] if mission.files else []),
        "requirements",
        *judgement_lines(outcome.plan.judgements, mission.step),
        *([solved] if solved else []),
        *_several(outcome.report),
        *(f"note: {note}" for note in outcome.report.notes),
        f"{counted(len(certificate.checks), 'check')} passed; smallest margin of each kind of check",
        *margin_lines(certificate),
        *between_lines(certificate.between),
        *delay_lines(certificate.delays),
    ]


def alternative_lines(alternatives: list[AlternativeRow]) -> list[str]:
    """Lines of a table of plans with length, duration and smallest margin, each with its differences.

    Empty without rows.
    """
    if not alternatives:
        return []
    columns = [
        [f"{each.rank}" for each in alternatives],
        [f"{each.length:.2f} m" for each in alternatives],
        [f"{each.duration:g} s" for each in alternatives],
        [f"margin {decimals(each.margin)} m" for each in alternatives],
    ]
    wide = [max(map(len, column)) for column in columns]
    lines = [f"{counted(len(alternatives), 'alternative plan')}, best first"]
    for number, each in enumerate(alternatives):
        figures = "  ".join(f"{column[number]:>{width}}" for column, width in zip(columns, wide, strict=True))
        lines += [f"  {figures}", *(f"     {words}" for words in each.differs)]
    return lines


def tried_lines(report: Report) -> list[str]:
    """Lines with the results of the engines in a portfolio that were run; empty if none was."""
    had = [each for each in report.tried if each.turns]
    width = max((len(each.engine) for each in had), default=0)
    return [f"backend {each.engine:<{width}}  {each}" for each in had]


def _several(report: Report) -> list[str]:
    """Lines with the results of the engines; empty if at most one was run."""
    lines = tried_lines(report)
    return lines if len(lines) > 1 else []


def attempt_lines(name: str, best: Attempt, step: Seconds) -> list[str]:
    """Lines about the best candidate of a failed search: each requirement, and the largest other violations.

    Args:
        name: name of the mission.
        best: best candidate.
        step: time step of the mission.
    """
    lines = [f"{name}: closest infeasible candidate", *judgement_lines(best.requirements, step)]
    faults = best.worst_faults()
    width = max((len(fault.what) for fault in faults), default=0)
    return [*lines, *(f"  {fault.what:<{width}}  violated  {_amount(fault, step)}" for fault in faults)]


def monitored_lines(monitored: Monitored) -> list[str]:
    """Lines with the verdict, each requirement and preference, and the constraints; empty for an invalid input."""
    mission = monitored.checked.mission
    if not monitored.ok or mission is None:
        return []
    lines = [f"{mission.name}: {monitored.verdict}", *judgement_lines(monitored.requirements, mission.step)]
    if monitored.preferences:
        lines += ["preferences", *judgement_lines(monitored.preferences, mission.step)]
    return [*lines, *constraint_lines(monitored.constraints, monitored.not_judged), *between_lines(monitored.between)]


def margin_lines(certificate: Certificate) -> list[str]:
    """Lines with the tightest check of each kind; the last counts the kinds with margin 0, such as equalities."""
    least: dict[str, Check] = {}
    for check in certificate.checks:
        if check.name not in least or check.margin < least[check.name].margin:
            least[check.name] = check
    shown = [check for check in least.values() if check.margin >= SHOWN]
    exact = [check.name for check in least.values() if check.margin < SHOWN]
    width = max((len(check.name) for check in shown), default=0)
    amounts = [f"{check.margin:.3f} {check.unit}".rstrip() for check in shown]
    lines = [f"  {each.name:<{width}}  {amount}{_where(each)}" for each, amount in zip(shown, amounts, strict=True)]
    return [*lines, f"  {counted(len(exact), 'other kind')} within tolerance"] if exact else lines


def between_lines(between: Iterable[Between]) -> list[str]:
    """Sentences about requirements that are violated or undecided between the steps."""
    return [f"note: {each.detail}" for each in between if not each.holds]


def delay_lines(delays: tuple[Delay, ...]) -> list[str]:
    """Line about the smallest allowed delay of an agent, and the effect of a longer one; empty without delays."""
    if not delays:
        return []
    least = min(delays, key=lambda each: each.tolerated)
    others = sum(each.tolerated == least.tolerated for each in delays) - 1
    agents = f"{least.agent}{f' and {others} more' if others else ''}"
    seconds = f"{'at least ' if least.open else ''}{least.tolerated:g} s"
    limit = f"; one more step violates {least.broken}" if least.breaks else ""
    return [f"delay tolerance: {seconds} for {agents}, if all other agents are on time{limit}"]


def folder_lines(files: Iterable[str]) -> list[str]:
    """Lines with the files of a folder; files of a subfolder share one line."""
    names: dict[str, list[str]] = {}
    for path in files:
        folder, slash, _ = path.partition("/")
        names.setdefault(folder + slash, []).append(path)
    return [
        f"  {name}" + (f"  {counted(len(paths), 'file')}" if name.endswith("/") else "")
        for name, paths in names.items()
    ]


def exported_lines(output: str, files: Iterable[str], notes: list[str]) -> list[str]:
    """Lines with notes, the written folder and its files."""
    return [*(f"note: {note}" for note in notes), f"output: {output}", *folder_lines(files)]


def timing_lines(seconds: tuple[tuple[str, Seconds], ...]) -> list[str]:
    """Lines with the duration of each stage in seconds; a repeated stage has one for each round."""
    width = max((len(name) for name, _ in seconds), default=0)
    return ["time", *(f"  {name:<{width}}  {value:8.3f} s" for name, value in seconds)]


def compiled_document(compiled: Compiled, output: str, texts: list[tuple[str, str]]) -> dict[str, object]:
    """JSON document of a compilation; run times are only here, and in no written file.

    Args:
        compiled: compilation.
        output: the written folder, or empty.
        texts: name and text of each requested stage.
    """
    outcome = compiled.outcome
    document: dict[str, object] = {
        "outcome": compiled.word,
        "output": output or None,
        "backend": _engine(compiled),
        "tried": [] if isinstance(outcome, InvalidMission) else [each.as_record() for each in outcome.report.tried],
        "places": file_records(compiled.checked.mission) if compiled.checked.mission else [],
        "solved": [],
        "requirements": [],
        "timings": _sums(compiled.seconds),
    }
    if isinstance(outcome, Verified):
        document["solved"] = [each.as_record() for each in outcome.plan.solved]
        document["requirements"] = [each.as_record() for each in outcome.plan.judgements]
        proven = outcome.plan.proven
        document["proven"] = proven.as_record() if proven else None
        document["notes"] = list(outcome.report.notes)
        document["cut_short"] = outcome.report.cut_short.value if outcome.report.cut_short else None
        document["between_steps"] = [_between(each) for each in outcome.certificate.between]
        document["alternatives"] = [each.row.as_record() for each in compiled.alternatives]
        document["delays"] = [asdict(each) for each in outcome.certificate.delays]
        document["certificate"] = {"checks": len(outcome.certificate.checks), "passed": outcome.certificate.passed}
    if isinstance(outcome, NotFound):
        document["best_attempt"] = _attempt(outcome.best)
    if isinstance(outcome, Impossible):
        document["conflict"] = list(outcome.conflict)
        document["scope"] = outcome.scope.value
        document["smallest"] = outcome.smallest
    if isinstance(outcome, Impossible | NotFound):
        document |= explained_document(compiled.explained)
    if texts:
        document["emit"] = dict(texts)
    return document


def _engine(compiled: Compiled) -> str | None:
    """Name of the backend that planned or had the best candidate; without one, the first to try.

    None for invalid missions.
    """
    if not isinstance(compiled.outcome, InvalidMission) and compiled.outcome.report.engine:
        return compiled.outcome.report.engine
    return compiled.checked.choice.backend if compiled.checked.choice else None


def monitored_document(monitored: Monitored) -> dict[str, object]:
    return {
        "satisfied": monitored.satisfied,
        "requirements": [each.as_record() for each in monitored.requirements],
        "preferences": [each.as_record() for each in monitored.preferences],
        **constraint_records(monitored.constraints, monitored.not_judged),
        "between_steps": [_between(each) for each in monitored.between],
    }


def reverified_lines(reverified: Reverified, verbose: bool) -> list[str]:
    """Lines about a successful verification of a folder and its margins; empty if it failed."""
    certificate = reverified.certificate
    if certificate is None or not certificate.passed:
        return []
    lines = [
        f"{certificate.mission}: verified from the files of the folder, "
        f"{counted(len(certificate.checks), 'check')} passed"
    ]
    lines += [
        f"  {each.folder}: verified, {counted(len(each.certificate.checks), 'check')} passed"
        for each in reverified.others
        if each.certificate is not None
    ]
    if reverified.proven:
        return [*lines, f"  proved: {reverified.proven}"]
    return [
        *lines,
        *plan_summary.worst_margins(certificate.judgements, certificate),
        *plan_summary.warning_lines(plan_summary.warnings_of(certificate), verbose),
        *(["smallest margin of each kind of check", *margin_lines(certificate)] if verbose else []),
        *(between_lines(certificate.between) if verbose else []),
        *(delay_lines(certificate.delays) if verbose else []),
    ]


def reverified_document(reverified: Reverified) -> dict[str, object]:
    """JSON document of a verification; ``passed`` is null if the folder is unreadable."""
    certificate = reverified.certificate
    failures = certificate.failures if certificate else ()
    return {
        "passed": certificate.passed if certificate else None,
        "checks": len(certificate.checks) if certificate else 0,
        "failures": [
            {
                "name": check.name,
                "subject": check.subject,
                "margin": _finite(check.margin),
                "unit": check.unit,
                "at": check.at,
            }
            for check in failures
        ],
        "proven": reverified.proven or None,
        "between_steps": [_between(each) for each in certificate.between] if certificate else [],
        "alternatives": [{"folder": str(each.folder), **reverified_document(each)} for each in reverified.others],
        "delays": [asdict(each) for each in certificate.delays] if certificate else [],
    }


def exported_document(output: str | None, files: Iterable[str], notes: list[str]) -> dict[str, object]:
    """JSON document of an export; ``output`` is null if nothing was written."""
    return {"output": output, "files": sorted(files) if output else [], "notes": notes}


def _amount(fault: Violation, step: Seconds) -> str:
    by = f"margin {decimals(fault.margin)} {fault.unit}  " if fault.margin < 0 else ""
    return f"{by}at {fault.step * step:g} s{in_brackets(fault.agents)}"


def _where(check: Check) -> str:
    when = "" if check.at is None else f" at {round(check.at, 2):g} s"
    what = "" if check.agents else f" of {check.subject}"
    return f"{what}{when}{in_brackets(check.agents)}"


def in_brackets(agents: tuple[str, ...]) -> str:
    """Names of agents in brackets, for the end of a value; empty if there are none."""
    return f" ({', '.join(agents)})" if agents else ""


def _between(between: Between) -> dict[str, object]:
    return {
        "requirement": between.requirement,
        "verdict": between.verdict.value,
        "at": between.at,
        "until": between.until,
        "agents": list(between.agents),
        "detail": between.detail,
    }


def _attempt(best: Attempt | None) -> dict[str, object] | None:
    if best is None:
        return None
    faults = [each.as_record() for each in best.worst_faults()]
    return {"requirements": [each.as_record() for each in best.requirements], "faults": faults}


def _sums(seconds: tuple[tuple[str, Seconds], ...]) -> dict[str, float]:
    sums: dict[str, float] = {}
    for name, value in seconds:
        sums[name] = sums.get(name, 0.0) + value
    return sums


# ------------------------------------------------------------------ vehicles


def vehicle_lines(vehicle: Vehicle) -> list[str]:
    """Lines of a table of a vehicle's parameters: name, value with unit, and meaning."""
    rows = [(name, text or "none", FIGURES[name].says) for name, text in figures_of(vehicle)]
    wide = [max(len(row[column]) for row in rows) for column in (0, 1)]
    return [f"{name:<{wide[0]}}  {text:<{wide[1]}}  {says}" for name, text, says in rows]


def vehicles_document(vehicles: Iterable[Vehicle]) -> dict[str, object]:
    """JSON document of the parameters of vehicles in their units: a band is two numbers, null means no limit."""
    return {
        "vehicles": [
            {"name": vehicle.name, "figures": {name: _figure(vehicle, name) for name in FIGURES}}
            for vehicle in vehicles
        ]
    }


def _figure(vehicle: Vehicle, name: str) -> dict[str, object]:
    value, unit = getattr(vehicle, name), SI[FIGURES[name].dimension].strip()
    if isinstance(value, Band):
        return {"value": [_finite(value.low), _finite(value.high)], "unit": unit}
    return {"value": _finite(value), "unit": unit}


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
