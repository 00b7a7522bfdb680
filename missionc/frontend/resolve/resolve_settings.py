"""Resolution of settings: each must be known, given once, and have the right relation sign.

says MC013 MC014 MC206
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import TypeVar

from missionc.base.diagnostics import code
from missionc.base.diagnostics.model import Fix, Label
from missionc.base.diagnostics.suggest import Nothing
from missionc.base.source import Span
from missionc.frontend.resolve.context import Context, deleted, some_of
from missionc.frontend.resolve.resolve_quantities import excerpt
from missionc.frontend.syntax import ast


def known_settings(
    context: Context, settings: Iterable[ast.Setting], known: Sequence[str], owner: str
) -> dict[str, ast.Setting]:
    """Settings by name; a setting that ``owner`` does not have, or that is repeated, is reported and omitted.

    A misspelt setting counts as the most similar one, so that this is not reported as missing.
    """
    by_name: dict[str, ast.Setting] = {}
    for setting in settings:
        name = setting.name.text
        if name not in known:
            meant = unknown_word(context, setting.name, known, owner, "setting")
            if isinstance(meant, str):
                by_name.setdefault(meant, replace(setting, name=replace(setting.name, text=meant)))
        elif name in by_name:
            said_twice(context, f"`{name}`", setting.span, by_name[name].span)
        else:
            by_name[name] = setting
    return by_name


def relation(context: Context, setting: ast.Setting, *allowed: str) -> None:
    """Report a setting whose relation sign is not one of the allowed signs (empty: a bare value)."""
    if setting.relation in allowed:
        return
    word = setting.name.text
    if allowed[0] == "<=" and setting.relation == "":
        context.report(
            code.UNKNOWN_SETTING,
            f"expected a limit, found `{excerpt(setting.span)}`",
            setting.span,
            help=f"write `{word} <= {setting.high.span.text}`",
            fix=Fix(setting.span, f"{word} <= {setting.high.span.text}"),
        )
        return
    form = {"<=": f"{word} <= VALUE", "..": f"{word} LOW..HIGH", "=": f"{word} = VALUE", "": f"{word} VALUE"}[
        allowed[0]
    ]
    context.report(
        code.UNKNOWN_SETTING,
        f"invalid form of `{word}`",
        setting.span,
        help=f"write `{form}`",
        fix=_as_value(setting, allowed[0]),
    )


def _as_value(setting: ast.Setting, wanted: str) -> Fix | None:
    """Fix that changes the relation sign of a setting, or None if a range is needed or written."""
    if setting.low is not None or wanted == "..":
        return None
    sign = f" {wanted} " if wanted else " "
    return Fix(setting.span, f"{setting.name.text}{sign}{setting.high.span.text}")


# ------------------------------------------------------------------ messages


def unknown_word(
    context: Context, name: ast.Name, known: Sequence[str], owner: str, noun: str, more: str = ""
) -> str | Nothing:
    """Report an unknown word, and return the most similar known word."""
    listed = f"use one of {some_of(list(known), 10)}{more}" if known else f"delete the {noun}"
    message = f"{owner} has no {noun} `{name.text}`"
    return context.report_unknown(code.UNKNOWN_SETTING, message, name.span, name.text, known, listed)


def said_twice(
    context: Context, what: str, span: Span, first: Span, fix: Fix | None = None, help: str | None = None
) -> None:
    context.report(
        code.DECLARED_AGAIN,
        f"{what} is given twice",
        span,
        beside="given again",
        labels=(Label(first, "first given here"),),
        help=help or "delete one of the two",
        fix=fix,
    )


Item = TypeVar("Item", bound=ast.Node)


def only(context: Context, items: Iterable[object], kind: type[Item], *, whole: bool = False) -> Item | None:
    """The single item of a kind, or None; repeated items are reported.

    Args:
        whole: if true, the items are declarations, so that reported ones may be deleted.
    """
    found = [item for item in items if isinstance(item, kind)]
    for again in found[1:]:
        word = again.span.text.split(maxsplit=1)[0]
        said_twice(context, f"`{word}`", again.span, found[0].span, deleted(again.span) if whole else None)
    return found[0] if found else None


def missing(context: Context, what: str, span: Span, way_out: str) -> None:
    context.report(code.DECLARATION_MISSING, f"{what} is missing", span, help=way_out)
