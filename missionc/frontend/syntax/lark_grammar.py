"""The grammar of the language as a ``lark.Lark`` parser, for converters and linters that walk the tree as written.

The compiler itself uses a parse table (``parse_table``), built from the same grammar.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from missionc.base.diagnostics.code import EXTRA_MISSING
from missionc.base.limits import Limits
from missionc.base.resources import folder
from missionc.base.source import Source, Span
from missionc.frontend.syntax.parse_table import END
from missionc.frontend.syntax.tokens import NAME, STRAY, tokenise

if TYPE_CHECKING:
    from lark import Lark

WHOLE = "\nprogram: start*\n"
"""Start rule for complete missions; the grammar itself describes one declaration."""


def grammar() -> Lark:
    """Lark parser of the mission language, with the language's own lexer.

    ``grammar().parse(text)`` gives a ``lark.Tree`` called ``program``. Its children are the declarations in the order
    of the text, trees named after the rules of ``grammars/mission.lark``; their leaves are ``lark.Token`` with lines
    and columns. An ``include`` stays as it is written. Names and units are not checked; ``missionc.check`` does that.

    Returns:
        An LALR parser without state between texts.

    Raises:
        ModuleNotFoundError: Lark is not installed; it comes with the extra ``grammar``.
        lark.UnexpectedInput: from its ``parse``, if a text is not a mission, with the line and column.
    """
    try:
        from lark import Lark, Token, UnexpectedCharacters
        from lark.lexer import Lexer, LexerState
    except ModuleNotFoundError as error:
        raise ModuleNotFoundError(
            f"{EXTRA_MISSING.name}: the grammar needs lark, which is not installed; "
            "install it with `pip install 'missionc[grammar]'`",
            name=error.name,
        ) from error

    names: dict[str, str] = {}

    class MissionLexer(Lexer):
        """Lark lexer with the tokens of ``tokens.py``: the parser's state decides which word is a name."""

        __future_interface__ = True  # Lark passes the parser's state as well

        def __init__(self, _: object) -> None:
            pass

        def lex(self, lexer_state: LexerState, parser_state: Any) -> Iterator[Token]:
            text = str(lexer_state.text.text)
            tokens, findings = tokenise(Span(Source("mission", text), 0, len(text)), Limits())
            wrong = {finding.primary.span.start for finding in findings if finding.primary}
            for token in tokens:
                if token.kind == END:
                    return
                start, end = token.span.start, token.span.end
                line, column = token.span.source.place(start)
                if token.kind == STRAY or start in wrong:
                    raise UnexpectedCharacters(text, start, line, column)  # type: ignore[no-untyped-call]
                kind = names.get(token.kind, token.kind)
                if token.may_be_name and not _takes(parser_state, kind):
                    kind = NAME
                yield Token(kind, token.text, start, line, column, line, column + end - start, end)

    text = (folder("grammars") / "mission.lark").read_text(encoding="utf-8")
    lark = Lark(text + WHOLE, parser="lalr", lexer=MissionLexer, start="program", maybe_placeholders=True)
    names |= {str(each.pattern.value): each.name for each in lark.terminals if each.pattern is not None}
    return lark


def _takes(parser_state: Any, kind: str) -> bool:
    """Return whether a token of that kind may come next; this requires simulating all its reductions."""
    from lark.parsers.lalr_analysis import Shift

    rows, states = parser_state.parse_conf.states, list(parser_state.state_stack)
    while kind in rows[states[-1]]:
        action, argument = rows[states[-1]][kind]
        if action is Shift:
            return True
        size = len(argument.expansion)
        del states[len(states) - size :]
        states.append(rows[states[-1]][argument.origin.name][1])
    return False
