"""Conventions of temporal logic on which tools differ, each with a tiny trace that separates two readings.

Tests evaluate both readings with the monitor.

Source:
    [strel] Table 1, its encoding and its prose; [clot] III-B; the published code of RTAMT 0.4.10,
    MoonLight 0.3.1, stljax and stlpy 0.3.0, each run on runs like these.
"""

from __future__ import annotations

from types import MappingProxyType

from missionc.base.late_dataclass import Record

FLAT = """
region f = box (0, 0) to (2, 1)
region g = box (1, 0) to (3, 1)
"""
"""Declarations of two overlapping regions: only f holds at x = 0.5, both at 1.5, only g at 2.5, none at 3.5.

The border of f is at x = 2.
"""

PLACES = MappingProxyType({("T", "F"): 0.5, ("T", "T"): 1.5, ("F", "T"): 2.5, ("F", "F"): 3.5})


class Example(Record):
    """Tiny trace with the truth of formulas in ``rows``: at each step or, if ``agents`` is True, for each agent.

    ``asked`` is a formula, and ``otherwise`` its other reading as a formula of the language; exactly one of them
    ``holds``.
    """

    declarations: str
    places: tuple[tuple[tuple[float, float], ...], ...]
    """Positions of each agent at each step, metres."""
    agents: bool
    rows: tuple[tuple[str, str], ...]
    asked: str
    otherwise: str
    holds: bool


class Trap(Record):
    """Convention of the language on which tools differ; ``says`` states it, ``elsewhere`` that of other tools."""

    name: str
    says: str
    elsewhere: str
    example: Example


def _steps(asked: str, otherwise: str, holds: bool, **rows: str) -> Example:
    """Example with one agent over a few steps, with ``f`` and ``g`` true as in the rows (``g`` false if omitted)."""
    f = rows["f"]
    g = rows.get("g", "F" * len(f))
    path = tuple((PLACES[pair], 0.5) for pair in zip(f, g, strict=True))
    return Example(FLAT, (path,), False, tuple(rows.items()), f"a[0]: {asked}", f"a[0]: {otherwise}", holds)


def _team(
    places: tuple[tuple[float, float], ...], asked: str, otherwise: str, holds: bool, **groups: tuple[int, ...]
) -> Example:
    """Example with agents a[0], a[1], … at one step, with radio links shorter than 1 m.

    Args:
        groups: names of predicates, such as ``f``, and the agents for which each holds.
    """
    lines = [f"group {name} = {', '.join(f'a[{agent}]' for agent in agents)}" for name, agents in groups.items()]
    rows = tuple(
        (name, "".join("T" if agent in agents else "F" for agent in range(len(places))))
        for name, agents in groups.items()
    )
    declarations = "\n".join(["", "graph radio = proximity 1 m", *lines, ""])
    readings = f"a[0]: {asked}", f"a[0]: {otherwise}"
    return Example(declarations, tuple((place,) for place in places), True, rows, *readings, holds)


PAIR = ((0.5, 0.5), (1.2, 0.5))
LINE = ((0.5, 0.5), (1.2, 0.5), (1.9, 0.5))
TRIANGLE = ((0.5, 0.5), (1.2, 0.5), (0.85, 1.1))
RING = ((0.5, 0.5), (1.3, 0.5), (1.3, 1.3), (0.5, 1.3))

TRAPS = (
    Trap(
        "until, at its end",
        "the left operand need not be true at the step at which the right operand becomes true",
        "the STREL paper and stljax require both operands at that step; write `f until[a, b] (f and g)` for this",
        _steps("f until[0 s, 2 s] g", "f until[0 s, 2 s] (f and g)", True, f="TTF", g="FFT"),
    ),
    Trap(
        "until, at its beginning",
        "the left operand must be true from the current step on",
        "the transport paper excludes the current step",
        _steps("f until[0 s, 2 s] g", "(g or next (f until[0 s, 1 s] g))", False, f="FTT", g="FFT"),
    ),
    Trap(
        "until, before its window",
        "the left operand must be true from the current step on, also before the window begins",
        "stlpy 0.3.0 requires the left operand from the first step of the window on",
        _steps("f until[1 s, 2 s] g", "eventually[1 s, 1 s] (f until[0 s, 1 s] g)", False, f="FTT", g="FFT"),
    ),
    Trap(
        "release, at its end",
        "the right operand must still be true at the step at which the left operand becomes true",
        "read as `g until f`, the right operand may be false at that step, and `f` must become true",
        _steps("f release[0 s, 2 s] g", "(g until[0 s, 2 s] f)", False, f="FTF", g="TFF"),
    ),
    Trap(
        "windows are closed",
        "both bounds belong to the window: [0 s, 2 s] has three steps of 1 s",
        "a half-open window, like an array slice, excludes the last step",
        _steps("always[0 s, 2 s] f", "always[0 s, 1 s] f", False, f="TTF"),
    ),
    Trap(
        "windows are not clipped",
        "an inner window has its full length from each step of the outer window, and the mission must last that long",
        "RTAMT cuts the window at the end of the trace, and stljax pads the trace (below: a trace of 2 s)",
        _steps(
            "always[0 s, 1 s] eventually[0 s, 2 s] f",
            "(eventually[0 s, 2 s] f and eventually[1 s, 2 s] f)",
            True,
            f="TFFT",
        ),
    ),
    Trap(
        "borders belong to regions",
        "an agent on the border of a region is in it",
        "the transport paper also writes predicates as `> 0`, which excludes the border",
        Example(FLAT, (((2.0, 0.5),),), False, (("f", "T"),), "a[0]: f", "a[0]: distance(f) < 0", True),
    ),
    Trap(
        "links are strict",
        "two agents whose distance is exactly the radius are not linked",
        "the STREL paper uses both: strictly less in its definition, `within 1 m` in its text",
        Example(
            "\ngraph radio = proximity 1 m\n",
            (((0.5, 0.5),), ((1.5, 0.5),)),
            True,
            (("distance(a[0]) <= 1 m", "TT"),),
            "connected(radio)",
            "distance(a[0], a[1]) <= 1 m",
            False,
        ),
    ),
    Trap(
        "zero hops",
        "with a lower bound of 0 the agent itself counts, even without a link",
        "the encoding of the STREL paper starts at one hop; write `hops 1..` to exclude the agent itself",
        _team(
            ((0.5, 0.5), (2.5, 0.5)), "somewhere[hops 0..2 on radio] f", "somewhere[hops 1..2 on radio] f", True, f=(0,)
        ),
    ),
    Trap(
        "last agent of a route",
        "the left operand must be true for every agent on the route except the last agent",
        "a phrase such as `over safe agents` may include the last agent; write `f reach[…] (f and g)` for this meaning",
        _team(PAIR, "(f reach[hops 0..1 on radio] g)", "(f reach[hops 0..1 on radio] (f and g))", True, f=(0,), g=(1,)),
    ),
    Trap(
        "routes do not turn back",
        "a route visits no agent twice",
        "in MoonLight a route may turn back: a hop and its reverse are two hops",
        _team(
            PAIR,
            "somewhere[hops 2..2 on radio] f",
            "somewhere[hops 1..1 on radio] somewhere[hops 1..1 on radio] f",
            False,
            f=(0,),
        ),
    ),
    Trap(
        "routes need not be shortest",
        "a route may be longer than the shortest route: an agent one hop away may be reached in two hops",
        "`somewhere` of MoonLight uses the shortest route, like `count` of missionc",
        _team(TRIANGLE, "somewhere[hops 2..2 on radio] f", "count[hops 2..2 on radio] f >= 1", True, f=(1,)),
    ),
    Trap(
        "escape without a lower bound",
        "with a lower bound of 0 the agent has already escaped, so only the operand remains",
        "the STREL paper uses it in this way; write `hops 1..` to require a route",
        _team(((0.5, 0.5), (2.5, 0.5)), "escape[hops 0..2 on radio] f", "escape[hops 1..2 on radio] f", True, f=(0,)),
    ),
    Trap(
        "length of an escape",
        "the length is that of the shortest route over all agents",
        "the table of the STREL paper uses the length of the route itself: in a ring of four, "
        "three hops reach a neighbour",
        _team(RING, "escape[hops 3.. on radio] f", "(f reach[hops 3.. on radio] f)", False, f=(0, 1, 2, 3)),
    ),
    Trap(
        "count includes the agent itself",
        "with a lower bound of 0 the count includes the agent itself",
        "a count of neighbours excludes the agent itself; write `hops 1..` for this meaning",
        _team(PAIR, "count[hops 0..1 on radio] f >= 2", "count[hops 1..1 on radio] f >= 2", True, f=(0, 1)),
    ),
    Trap(
        "surround without neighbours",
        "an agent without neighbours is surrounded if the left operand is true, because no route leaves it",
        "a reading that requires a neighbour adds `somewhere[…] g`",
        _team(
            ((0.5, 0.5), (2.5, 0.5)),
            "(f surround[hops 0..2 on radio] g)",
            "((f surround[hops 0..2 on radio] g) and somewhere[hops 0..2 on radio] g)",
            True,
            f=(0,),
            g=(1,),
        ),
    ),
)
"""Conventions on which tools differ, in the order in which a page lists them."""
