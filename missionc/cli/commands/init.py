"""``missionc init [NAME]``: creation of a mission file from a template.

says MC007 MC701 MC702
"""

from __future__ import annotations

import os
import re
from pathlib import Path

import click

from missionc.base.diagnostics.code import NAME_NOT_ALLOWED, OUTPUT_EXISTS
from missionc.base.diagnostics.model import Diagnostic
from missionc.base.limits import Limits
from missionc.base.source import Source
from missionc.cli.exit_status import Status, say
from missionc.cli.options import form_flag
from missionc.compiler.front_end import check
from missionc.frontend.syntax.tokens import nameable, quoted, reserved
from missionc.frontend.templates import DEFAULT, Template, templates
from missionc.output.folder.write_folder import refuse_file, write_file

SUFFIX = ".mission"


@click.command("init")
@click.argument("name", required=False)
@click.option(
    "--template",
    type=click.Choice(list(templates())),
    default=DEFAULT,
    show_default=True,
    help="Template of the new mission.",
)
@click.option("--list", "listed", is_flag=True, help="List the templates with their topics.")
@click.option("--force", is_flag=True, help="Replace an existing file.")
@form_flag
def command(name: str | None, template: str, listed: bool, force: bool, form: str) -> Status:
    """Create a mission file NAME.mission from a template.

    NAME may include a folder, such as north/patrol. By default, NAME is the mission name of the template.
    """
    if listed:
        return _list(form)
    chosen = templates()[template]
    path = Path(name or chosen.mission)
    mission = path.name.removesuffix(SUFFIX)
    target = path.parent / f"{mission}{SUFFIX}"
    wrong = _name_refused(mission)
    wrong = wrong or _file_refused(target, force) or refuse_file(target)
    wrong = wrong or write_file(target, chosen.named(mission).encode("utf-8"))
    if wrong:
        say([wrong], [], form, {"written": None, "template": template})
        return Status.MISSION_ERRORS
    lines = [
        f"created {target} from the template `{template}`",
        "next steps",
        *(f"  missionc {command} {target}" for command in ("check", "explain", "compile")),
    ]
    say([], lines, form, {"written": str(target), "template": template})
    return Status.DONE


def _list(form: str) -> Status:
    known = templates().values()
    wide = max(len(each.name) for each in known)
    lines = [f"{each.name:{wide}}  {each.about}" for each in known]
    document = [{"name": each.name, "about": each.about, "backend": _backend(each)} for each in known]
    say([], lines, form, {"templates": document})
    return Status.DONE


def _backend(template: Template) -> str:
    choice = check(Source(f"{template.name}{SUFFIX}", template.text)).choice
    return choice.backend if choice else ""


def _name_refused(name: str) -> Diagnostic | None:
    """Finding about an invalid mission name; None if the name is valid."""
    if reserved(name):
        message = f"{quoted(name)} is a keyword and cannot be the name of a mission"
        return Diagnostic(NAME_NOT_ALLOWED, message, None, help=f"choose another name, such as `{name}_1`")
    most = Limits().name_length
    if not nameable(name) or len(name) > most:
        message = f"{quoted(name)} cannot be the name of a mission"
        note = f"a name has at most {most} letters a to z, digits and `_`, without a digit first"
        return Diagnostic(
            NAME_NOT_ALLOWED, message, None, notes=(note,), help=f"choose another name, such as `{_like(name)}`"
        )
    return None


def _like(name: str) -> str:
    """Valid mission name that resembles the requested one."""
    letters = re.sub(r"[^A-Za-z0-9_]+", "_", name)[:40].strip("_") or "patrol"
    return letters if nameable(letters) else f"mission_{letters}"


def _file_refused(target: Path, force: bool) -> Diagnostic | None:
    if not os.path.lexists(target) or force:
        return None
    help_ = "replace it with `--force`"
    return Diagnostic(OUTPUT_EXISTS, f"`{target}` exists", None, help=help_)
