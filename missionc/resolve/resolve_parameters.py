"""Resolution of parameters: their values, or the ones the command line gives instead.

says MC106 MC201 and whatever is wrong with a value
"""

from __future__ import annotations

from dataclasses import replace

from missionc.base.limits import Limits
from missionc.base.source import Source, Span
from missionc.diagnostics import code
from missionc.diagnostics.model import Diagnostic
from missionc.diagnostics.suggest import nearest
from missionc.resolve.amounts import PLAIN
from missionc.resolve.context import Context
from missionc.resolve.definitions import ordered
from missionc.resolve.names import some_of
from missionc.resolve.resolve_quantities import NO_AMOUNT, evaluate, measured
from missionc.syntax import ast
from missionc.syntax.parse import parse


def resolve_parameters(context: Context, overrides: dict[str, str]) -> None:
    """Every parameter's value, the ones that others are made of first."""
    values = {param.name.text: param.value for param in context.declared(ast.Param)}
    written = dict(values)
    for name, text in overrides.items():
        if name not in values:
            context.findings.append(_unknown_parameter(name, list(values)))
            continue
        value, findings = read_quantity(name, text, context.limits)
        context.findings.extend(_from_command_line(finding, name, text) for finding in findings)
        if not findings:
            values[name] = value
    for name in ordered(context, values):
        before = len(context.findings)
        context.params[name] = evaluate(context, values[name])
        if values[name] is not written[name]:
            _same_kind(context, name, overrides[name], written[name])
            context.findings[before:] = [
                _from_command_line(finding, name, overrides[name]) for finding in context.findings[before:]
            ]
    for name in values:
        context.params.setdefault(name, NO_AMOUNT)


VALUE = "value"
"""A parameter's name while its value is read: a member of a family, `p[2]`, could not stand there."""


def read_quantity(name: str, text: str, limits: Limits) -> tuple[ast.Quantity, list[Diagnostic]]:
    """The quantity in a text such as ``30 s`` or ``(2 m)``, or findings about it."""
    source = Source(f"-D {name}", f"mission override\nparam {VALUE} = {text}\n")
    program, findings = parse(source, limits, _nothing_to_include)
    everywhere = Span(source, 0, len(source.text))
    nothing = ast.Number(everywhere, 0.0)
    if findings or program is None:
        return nothing, findings
    match program.declarations:
        case (ast.MissionName(), ast.Param(name=ast.Name(text=declared), value=value)) if declared == VALUE:
            return value, []
        case _:
            return nothing, [Diagnostic(code.SYNTAX, "a quantity is expected, and nothing else", None)]


def _nothing_to_include(written: str, span: Span, /, *, data: bool = False) -> Diagnostic:
    return Diagnostic(code.INCLUDE_NOT_ALLOWED, "an include cannot stand here", None)


def _same_kind(context: Context, name: str, text: str, written: ast.Quantity) -> None:
    """Reports a value that measures something else than the one in the mission."""
    new = context.params[name].powers
    old = evaluate(context, written).powers
    if PLAIN not in (new, old) and new != old:
        context.findings.append(
            Diagnostic(
                code.WRONG_UNIT,
                f"`{text}` is {measured(new)}; `{name}` is {measured(old)}",
                None,
                help=f"give {measured(old)}",
            )
        )
        context.params[name] = NO_AMOUNT


# ------------------------------------------------------------------ messages


def _from_command_line(finding: Diagnostic, name: str, text: str) -> Diagnostic:
    """The finding without its places: the text it is about stands in no file."""
    return replace(
        finding,
        message=f"in `-D {name}={text}`: {finding.message}",
        primary=None,
        labels=(),
        help=finding.help,
        fix=None,
    )


def _unknown_parameter(name: str, names: list[str]) -> Diagnostic:
    near = nearest(name, names)
    listed = f"the parameters are {some_of(names)}" if names else "declare it in the mission: `param NAME = VALUE`"
    return Diagnostic(
        code.UNKNOWN_PARAMETER,
        f"no parameter is called `{name}`",
        None,
        help=f"did you mean `{near}`?" if isinstance(near, str) else listed,
    )
