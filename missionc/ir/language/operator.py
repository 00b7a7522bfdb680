"""The operator as data: a value with its spelling, its bounds, its kernel form, and an example."""

from __future__ import annotations

from collections.abc import Callable
from enum import Enum

from missionc.base.late_dataclass import Record
from missionc.base.source import Span
from missionc.ir import Apply, Graph, Length, Period, Window
from missionc.ir.kernel.nodes import Node


class Bounds(Enum):
    """What stands in the square brackets after the operator; a period, before a colon."""

    NONE = "no bounds"
    TIME = "a time window"
    PAST = "a time window that ends, and reaches back"
    LENGTH = "a route length"
    PERIOD = "a time"


class Fixity(Enum):
    PREFIX = "before its operand"
    INFIX = "between its operands"


class Use(Record):
    """One use of an operator: everything its meaning may depend on.

    ``arguments`` are kernel nodes; ``comparison`` and ``number`` are ``count``'s.
    """

    arguments: tuple[Node, ...]
    bounds: Window | Length | Period | None
    span: Span
    comparison: str = ""
    number: int = 0
    room: int = 1_000_000
    """How many kernel nodes the use may cost."""

    @property
    def window(self) -> Window:
        assert isinstance(self.bounds, Window)
        return self.bounds

    @property
    def back(self) -> tuple[int, int]:
        """The window of an operator of the past as steps ahead: the one furthest back first, neither above 0."""
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
    """The use would cost so many kernel nodes at least, more than its ``room``."""

    nodes: int


def no_traps(use: Apply) -> tuple[str, ...]:
    """No traps: the operator means the same everywhere."""
    return ()


class Operator(Record):
    """``expand`` gives the meaning in kernel form; ``letter`` is the logic's own spelling (``G``, ``->``), if any.

    ``spatial`` operators look along a graph, so their operands are about one
    agent and so is the whole; the others keep whom their operands are about.

    ``says`` is the meaning in a few words. ``reads`` is a sentence with places to
    fill: ``{body}``, or ``{left}`` and ``{right}``, or ``{parts}`` of a chain, are the
    operands; ``{each}``, ``{some}``, ``{before}`` and ``{earlier}`` say the window, ``{period}`` and ``{start}`` how
    long the stretches are and when the first begins;
    ``{route}``, ``{far}``, ``{graph}``, ``{here}``, ``{perhaps}``, ``{included}`` and
    ``{number}`` what a spatial operator looks at. Its operands are verbs: ``that
    {right}``, or with a noun ``{left:agent on it}``, "every agent on it is …".

    ``traps`` are the conventions that a use hangs on and that other tools have
    otherwise, by their names in ``explain.convention_examples``.
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
        """Return whether it looks along a graph."""
        return self.bounds is Bounds.LENGTH

    @property
    def arity(self) -> int:
        return 2 if self.fixity is Fixity.INFIX else 1
