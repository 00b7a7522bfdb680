"""A typed formula: a resolved one at its place in the text, with whom it is about."""

from __future__ import annotations

from missionc import ir
from missionc.base.late_dataclass import dataclass
from missionc.base.source import Span
from missionc.ir import About


@dataclass(frozen=True, slots=True)
class Typed:
    """A resolved formula at one place of the text.

    ``mixed``: some operands are about one agent and some about the team; then
    ``about`` means nothing. ``operands`` are those that decide, the formula's
    own but not those inside a ``let`` that it names. ``size`` counts the nodes
    with every ``let`` spelt out, ``depth`` how many are in one another; the size
    is NaN once it is reported to be too large.
    """

    formula: ir.Formula
    about: About
    span: Span
    operands: tuple[Typed, ...] = ()
    mixed: bool = False
    size: float = 1
    depth: int = 1


def joined(operands: tuple[Typed, ...]) -> tuple[About, bool]:
    """Whom a formula of these operands is about, and whether they are mixed."""
    abouts = {operand.about for operand in operands} - {About.EITHER}
    mixed = len(abouts) > 1 or any(operand.mixed for operand in operands)
    return (About.EITHER if mixed or not abouts else abouts.pop()), mixed
