"""``missionc explain``: explanation of a diagnostic code, or of a mission in plain sentences."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import click
from click.shell_completion import CompletionItem

from missionc.base.diagnostics.code import CODES
from missionc.base.diagnostics.code import explain as page_of
from missionc.base.diagnostics.suggest import nearest
from missionc.cli.exit_status import Status, say
from missionc.cli.markdown_page import rendered_page
from missionc.cli.options import Pairs, existing, files, of_mission, one_of, read_limits
from missionc.compiler.front_end import check
from missionc.frontend.explain.explanation import document, explained, lines
from missionc.ir.language.walk_formulas import goals

CODE = re.compile(r"(MC)?\d{1,3}", re.IGNORECASE)


def _codes_or_files(context: click.Context, parameter: click.Parameter, incomplete: str) -> list[CompletionItem]:
    codes = one_of(lambda: CODES)(context, parameter, incomplete) if incomplete else []
    return codes or files(context, parameter, incomplete)


@click.command("explain")
@click.argument("what", required=False, shell_complete=_codes_or_files, metavar="[CODE | FILE]")
@click.argument("requirement", required=False)
@of_mission
def command(what: str | None, requirement: str | None, overrides: Pairs, limits: Pairs, form: str) -> Status:
    """Explain a mission, a requirement or an error code.

    An argument such as MC301 is an error code; any other argument is a mission file. Without an argument, the command
    lists all codes.
    """
    if what is not None and not CODE.fullmatch(what):
        return _mission(existing(what), requirement, dict(overrides), limits, form)
    if what is None and (overrides or limits):
        raise click.UsageError("`-D` and `--limit` need a mission; add its file")
    if requirement is not None or overrides or limits:
        raise click.UsageError(
            f"the code `{what}` takes no further arguments or options; write `./{what}` if it is a file"
        )
    if what is None:
        titles = [f"{code.name}  {code.title}" for code in CODES.values()]
        say([], titles, form, {"codes": [{"code": code.name, "title": code.title} for code in CODES.values()]})
        return Status.DONE
    name = f"MC{what}" if what.isdigit() else what.upper()
    if name not in CODES:
        near = nearest(name, CODES)
        hint = f"did you mean {near}?" if isinstance(near, str) else "run `missionc explain` to list all codes"
        raise click.UsageError(f"unknown code `{what}`; {hint}")
    page = page_of(CODES[name])
    if form == "text":
        click.echo(rendered_page(page))
        return Status.DONE
    say([], [], form, {"code": name, "title": CODES[name].title, "page": page})
    return Status.DONE


def _mission(file: Path, name: str | None, overrides: dict[str, str], limits: Pairs, form: str) -> Status:
    checked = check(file, overrides=overrides, limits=read_limits(limits))
    mission = checked.mission
    if mission is None:
        say(checked.findings, [], form, {"mission": None})
        return Status.MISSION_ERRORS
    known = [goal.name for goal in goals(mission)]
    if name is not None and name not in known:
        near = nearest(name, known)
        hint = (
            f"did you mean `{near}`?" if isinstance(near, str) else f"its requirements are {', '.join(known) or 'none'}"
        )
        raise click.UsageError(f"`{file}` has no requirement `{name}`; {hint}")
    parts = explained(mission, name)
    say(
        checked.findings,
        lines(parts, mission, checked.choice, _unicode()),
        form,
        document(parts, mission, checked.choice),
    )
    return Status.DONE if checked.ok else Status.MISSION_ERRORS


def _unicode() -> bool:
    """Return whether standard output can encode the block characters of a drawing."""
    try:
        "█░─".encode(sys.stdout.encoding or "ascii")
    except (UnicodeEncodeError, LookupError):
        return False
    return True
