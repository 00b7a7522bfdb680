"""Position of a syntax error, with the data for a finding there."""

from __future__ import annotations

from collections.abc import Collection, Sequence

from missionc.base.diagnostics.code import SYNTAX, Code
from missionc.base.diagnostics.model import Diagnostic, Fix, Label
from missionc.base.diagnostics.suggest import nearest
from missionc.base.late_dataclass import Record
from missionc.base.source import Span
from missionc.frontend.syntax import forms
from missionc.frontend.syntax.parse_table import END
from missionc.frontend.syntax.tokens import Token


class Place(Record):
    """Position of a syntax error: at token ``here`` of the declaration that starts at token ``first``.

    ``opened`` are the brackets not yet closed, outermost first.
    """

    tokens: Sequence[Token]
    first: int
    here: int
    expected: frozenset[str]
    opened: tuple[int, ...]

    @property
    def found(self) -> Token:
        return self.tokens[self.here]

    @property
    def before(self) -> Token:
        return self.tokens[max(self.here - 1, self.first)]

    @property
    def declaration(self) -> Token:
        return self.tokens[self.first]

    @property
    def in_formula(self) -> bool:
        return self.declaration.word in ("let", "require", "prefer")

    @property
    def in_bounds(self) -> bool:
        """True if the innermost open bracket is a square bracket."""
        return bool(self.opened) and self.tokens[self.opened[-1]].kind == "["

    @property
    def ends(self) -> bool:
        """True if the declaration ended too early: the next declaration begins here, or the file ends."""
        return self.here > self.first and (self.found.kind == END or (self.found.declares and self.found.starts_line))

    def after(self, closing: int) -> int:
        """Index of the opening bracket that matches the bracket at ``closing``."""
        depth = 0
        for place in range(closing, self.first, -1):
            depth += (self.tokens[place].kind in ")]}") - (self.tokens[place].kind in "([{")
            if depth == 0:
                return place
        return self.first


def finding(
    message: str,
    span: Span,
    advice: str,
    replacement: str | None = None,
    code: Code = SYNTAX,
    fix: Fix | None = None,
    labels: tuple[Label, ...] = (),
) -> Diagnostic:
    """Finding about a syntax error at a span.

    Args:
        replacement: text that replaces the span, as a fix.
        fix: fix of another span.
    """
    if replacement is not None:
        fix = Fix(span, replacement)
    return Diagnostic(code, message, Label(span), labels, help=advice, fix=fix)


def just_after(span: Span) -> Span:
    """Empty span directly after a part of the text."""
    return Span(span.source, span.end, span.end)


def meant_by(text: str, words: Collection[str]) -> str:
    """The word of the language for a word of another language, or else the most similar word.

    Empty if there is none.
    """
    ours = forms.WORDS.get(text.lower(), "")
    if ours in words:
        return ours
    near = nearest(text, sorted(words))
    return near if isinstance(near, str) else ""
