"""``missionc monitor FILE --live``: output of a monitoring session, as text or as lines of JSON."""

from __future__ import annotations

import math
import sys
import threading
from collections.abc import Iterable, Sequence
from contextlib import nullcontext, suppress

import click

from missionc.base.constraint import constraint_lines, constraint_records
from missionc.base.diagnostics.code import IMPLAUSIBLE_TIME, RECORDING_BROKEN, UNUSABLE_SAMPLE
from missionc.base.diagnostics.model import Diagnostic
from missionc.base.diagnostics.render import as_json, render_json, render_text
from missionc.base.signals import Stopped
from missionc.base.trace import decimals
from missionc.cli.browser import said
from missionc.cli.exit_status import Status, columns, in_colour, say_line
from missionc.cli.flight_page import FlightPage
from missionc.verification.monitoring.live.mcap_poses import BrokenRecordingError
from missionc.verification.monitoring.live.session import (
    Breach,
    Change,
    Event,
    Forecast,
    Implausible,
    Judged,
    Outrun,
    Presence,
    Session,
    Unusable,
)
from missionc.verification.monitoring.live.verdicts import LiveVerdict, Standing

MOST_UNUSABLE = 20
"""Maximum number of unusable lines that are reported individually; the summary counts all."""

STATUS = {LiveVerdict.SATISFIED: Status.DONE, LiveVerdict.VIOLATED: Status.VIOLATED, LiveVerdict.OPEN: Status.UNDECIDED}

HELP = 'write lines such as `{"t": 1.25, "agent": "drone[0]", "position": [1, 2]}`, in seconds and metres'


def run(
    session: Session, lines: Iterable[str], form: str, page: FlightPage | None = None, no_open: bool = True
) -> Status:
    """Evaluate samples until the mission or the stream ends, or the user interrupts; return the exit status.

    Args:
        session: monitoring session of the mission.
        lines: lines with samples.
        form: output format, ``text`` or ``json``.
        page: live page, which stays after the end of the stream until the user interrupts; None for none.
        no_open: if true, the page is not opened in a browser.
    """
    voice = _Voice(session, form, page)
    with page or nullcontext():
        if page:
            voice.say_page(page.address, no_open)
        patient, broken = True, False
        try:
            for line in lines:
                voice.tell(session.feed(line))
                if page:
                    page.heard(session.steps.newest)
                if session.over:
                    break
        except (KeyboardInterrupt, Stopped):
            patient = False
        except (BrokenRecordingError, OSError) as error:
            broken = True
            reason = getattr(error, "strerror", None) or str(error)
            voice.fail(Diagnostic(RECORDING_BROKEN, f"the recording cannot be read further: {reason}", None))
        voice.tell(session.finish())
        voice.sum_up()
        if page and patient:
            page.end("end of the mission" if session.over else "end of the stream")
            voice.wait()
    return Status.MISSION_ERRORS if broken else STATUS[session.verdict]


def tell_findings(findings: Sequence[Diagnostic], form: str) -> None:
    """Print findings on standard error, or as a JSON line on standard output."""
    if findings and form == "json":
        _line({"diagnostics": render_json(findings)})
    elif findings:
        terminal = sys.stderr.isatty()
        click.echo(render_text(findings, in_colour(terminal), columns(terminal)), err=True, color=True)


class _Voice:
    """Output of a monitoring session, event by event."""

    def __init__(self, session: Session, form: str, page: FlightPage | None) -> None:
        self.session, self.json, self.page = session, form == "json", page
        self.step = float(session.mission.step)
        self.width = max((len(goal.name) for goal in session.judge.goals), default=0)
        self.unusable = 0
        self.help_ahead = f"change the limit of {session.steps.leap:g} s with `--leap`"

    def tell(self, events: Iterable[Event]) -> None:
        for event in events:
            if self.page:
                self.page.publish(event)
            match event:
                case Unusable(line, reason):
                    self._unusable(Diagnostic(UNUSABLE_SAMPLE, f"line {line}: {reason}", None, help=HELP))
                case Implausible(line, agent, time):
                    reason = f"line {line}: the time of `{agent}`, {time:g} s, is far ahead and needs confirmation"
                    self._unusable(Diagnostic(IMPLAUSIBLE_TIME, reason, None, help=self.help_ahead))
                case Change(step, standing, unit, _, by_plan):
                    words = f"{standing.name:<{self.width}}  {_words(standing, unit, self.step, by_plan)}"
                    self._say(
                        step,
                        words,
                        {
                            "goal": standing.name,
                            "preference": event.preference,
                            **_record(standing, self.step, by_plan),
                        },
                    )
                case Forecast(step, name, margin, unit):
                    says = "the plan violates it" if margin < 0 else "the plan satisfies it again"
                    words = f"{name:<{self.width}}  {says}  robustness {decimals(margin)} {unit}".rstrip()
                    self._say(step, words, {"forecast": name, "preference": event.preference, "by_plan": margin})
                case Presence(step, missing, back):
                    who = ((missing, "missing"), (back, "received again"))
                    words = "; ".join(f"{', '.join(names)} {says}" for names, says in who if names)
                    self._say(step, words, {"missing": list(missing), "back": list(back)})
                case Outrun(step, agents):
                    words = f"{', '.join(agents)} exceeded the top speed; top-speed forecasts are withdrawn"
                    self._say(step, words, {"outrun": list(agents)})
                case Breach(step, constraint):
                    record = constraint_records([constraint], [])["constraints"]
                    self._say(step, f"violated: {constraint.violation()}", {"constraints": record})
                case Judged():
                    pass

    def say_page(self, address: str, no_open: bool) -> None:
        """Print the address of the live page, and open it unless disabled."""
        words = said(address, no_open, address, "live page")
        if self.json:
            _line({"page": address})
        else:
            say_line(words)
            sys.stdout.flush()

    def wait(self) -> None:
        """Wait until Ctrl-C."""
        if not self.json:
            say_line("the page stays open until Ctrl-C")
        sys.stdout.flush()
        with suppress(KeyboardInterrupt, Stopped):
            threading.Event().wait()

    def sum_up(self) -> None:
        """Print the state of every requirement and preference, and the statistics of the samples."""
        session, name = self.session, self.session.mission.name
        seen, notes = session.steps.closed, session.notes()
        watch = session.constraints
        constraints = ((), ()) if watch is None else (watch.constraints(), watch.not_judged())
        verdict = "not decided" if session.verdict is LiveVerdict.OPEN else session.verdict.value
        if self.json:
            records = [
                {"goal": each.name, **_record(each, self.step, session.by_plan.get(number))}
                for number, each in enumerate(session.standings)
            ]
            of = session.requirements
            summary = {"verdict": verdict, "requirements": records[:of], "preferences": records[of:]}
            summary |= constraint_records(*constraints)
            _line({"summary": {**summary, "steps": seen, "of": session.judge.last + 1, "notes": notes}})
            return
        say_line(f"{name}: {verdict} after {seen} of {session.judge.last + 1} steps")
        for number, each in enumerate(session.standings):
            if number == session.requirements:
                say_line("preferences")
            by_plan = session.by_plan.get(number)
            say_line(f"  {each.name:<{self.width}}  {_words(each, session.units[number], self.step, by_plan)}")
        for words in constraint_lines(*constraints):
            say_line(words)
        for note in notes:
            say_line(f"note: {note}")

    def _unusable(self, finding: Diagnostic) -> None:
        self.unusable += 1
        if self.unusable <= MOST_UNUSABLE:
            self.fail(finding)

    def fail(self, finding: Diagnostic) -> None:
        """Print a finding in the session's output format."""
        tell_findings([finding], "json" if self.json else "text")

    def _say(self, step: int, words: str, record: dict[str, object]) -> None:
        if self.json:
            _line({"t": step * self.step, "step": step, **record})
        else:
            say_line(f"{step * self.step:.2f} s  {words}")
            sys.stdout.flush()


def _line(record: dict[str, object]) -> None:
    click.echo(" ".join(part.strip() for part in as_json(record).split("\n")))
    sys.stdout.flush()


def _words(standing: Standing, unit: str, step: float, by_plan: float | None) -> str:
    """Verdict and robustness interval in words: ``open robustness -0.400 to 2.000 m, by the plan 0.100 m, …``.

    Args:
        standing: current state of the requirement.
        unit: unit of its robustness.
        step: time step of the mission, s.
        by_plan: robustness in the plan; None without a plan.
    """
    if standing.least == standing.most:
        robustness = f"robustness {decimals(standing.least)} {unit}".rstrip()
    else:
        robustness = f"robustness {decimals(standing.least)} to {decimals(standing.most)} {unit}".rstrip()
    if standing.verdict is not LiveVerdict.OPEN:
        return f"{standing.verdict.value} (final)  {robustness}"
    risk = "at risk" if standing.at_risk else "open"
    planned = "" if by_plan is None else f", by the plan {decimals(by_plan)} {unit}".rstrip()
    return f"{risk}  {robustness}{planned}, final by {standing.decided_by * step:g} s"


def _record(standing: Standing, step: float, by_plan: float | None) -> dict[str, object]:
    return {
        "verdict": standing.verdict.value,
        "at_risk": standing.at_risk,
        "least": standing.least if math.isfinite(standing.least) else None,
        "most": standing.most if math.isfinite(standing.most) else None,
        "by_plan": by_plan if by_plan is not None and math.isfinite(by_plan) else None,
        "decided_by": standing.decided_by * step,
    }
