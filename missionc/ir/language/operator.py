"""The operator as data: a value with its spelling, its bounds, its kernel form, and an example."""

from __future__ import annotations

from collections.abc import Callable
from enum import Enum

from missionc.base.late_dataclass import Record
from missionc.base.source import Span
from missionc.ir import Apply, Graph, Length, Period, Window
from missionc.ir.kernel.nodes import Node


class Bounds(Enum):
    """Content of the square brackets after the operator; for a period, the part before the colon."""

    NONE = "no bounds"
    TIME = "a time window"
    PAST = "a time window that ends, and reaches back"
    LENGTH = "a route length"
    PERIOD = "a time"


class Fixity(Enum):
    PREFIX = "before its operand"
    INFIX = "between its operands"


class Use(Record):
    """One use of an operator, with all values that its meaning may depend on.

    ``arguments`` are kernel nodes; only ``count`` uses ``comparison`` and ``number``.
    """

    arguments: tuple[Node, ...]
    bounds: Window | Length | Period | None
    span: Span
    comparison: str = ""
    number: int = 0
    room: int = 1_000_000
    """Maximum number of kernel nodes for the use."""

    @property
    def window(self) -> Window:
        assert isinstance(self.bounds, Window)
        return self.bounds

    @property
    def back(self) -> tuple[int, int]:
        """Window of a past operator as steps ahead: the earliest first, neither above 0."""
        low, high = self.window.low, self.window.high
        assert high is not None
        return -high, -low

    @property
    def period(self) -> int:
        assert isinstance(self.bounds, Period)
        return self.bounds.steps

    @property
    def length(self) -> Length:
        assert isinstance(self.bounds, Length)
        return self.bounds

    @property
    def graph(self) -> Graph:
        return self.length.graph


class TooLarge(Record):
    """Result of a use that would need at least this many kernel nodes, more than its ``room``."""

    nodes: int


def no_traps(use: Apply) -> tuple[str, ...]:
    """No traps: the operator means the same in all tools."""
    return ()


class Operator(Record):
    """Operator.

    ``expand`` gives its kernel form; ``letter`` is its symbol in logic (``G``, ``->``), if any.

    ``spatial`` operators follow a graph: their operands and the result are about one agent. Other operators keep the
    subject of their operands.

    ``says`` is the meaning in a few words. ``reads`` is a sentence with placeholders: ``{body}``, or ``{left}`` and
    ``{right}``, or ``{parts}`` of a chain, are the operands. ``{each}``, ``{some}``, ``{before}`` and ``{earlier}``
    stand for the window. ``{period}`` and ``{start}`` stand for the length of the periods and the start of the first.
    ``{route}``, ``{far}``, ``{graph}``, ``{here}``, ``{perhaps}``, ``{included}`` and ``{number}`` belong to spatial
    operators. Their operands are verbs: ``that {right}``, or with a noun ``{left:agent on it}``, "every agent on it is
    …".

    ``traps`` lists conventions that affect a use and differ in other tools, by their names in
    ``explain.convention_examples``.
    """

    name: str
    expand: Callable[[Use], Node | TooLarge]
    says: str
    reads: str
    example: str
    letter: str = ""
    fixity: Fixity = Fixity.PREFIX
    bounds: Bounds = Bounds.NONE
    traps: Callable[[Apply], tuple[str, ...]] = no_traps

    @property
    def spatial(self) -> bool:
        """True if it looks along a graph."""
        return self.bounds is Bounds.LENGTH

    @property
    def arity(self) -> int:
        return 2 if self.fixity is Fixity.INFIX else 1
