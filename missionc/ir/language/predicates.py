"""Vocabulary of predicates as data: names, subjects, parameters, wording and examples.

``ir.predicates`` defines the margins and the wording of each predicate.
"""

from __future__ import annotations

from collections.abc import Callable

from missionc import ir
from missionc.base.late_dataclass import Record
from missionc.ir import About
from missionc.ir.predicates import Connected, Inside, Touches


class Predicate(Record):
    """Predicate of the mission language.

    Args:
        about: subject of the predicate; EITHER if its parameters decide.
        parameters: names of the parameters in order; a name that ends in ``?`` is optional.
        says: meaning in a few words.
        meant: function from the arguments (None for an omitted one) to the predicate; None if the predicate has its own
            syntax.
    """

    name: str
    about: About
    parameters: tuple[str, ...]
    says: str
    example: str
    meant: Callable[..., ir.Predicate] | None = None

    @property
    def called(self) -> bool:
        """True if missions write the predicate as a name with arguments in brackets; others have their own syntax
        (``example``)."""
        return self.meant is not None


HEADING = Predicate(
    "heading",
    About.AGENT,
    ("an angle", "a direction or a beacon"),
    "the agent's heading differs by at most the angle from a direction, or from the direction to a beacon",
    "heading within 10 deg of 90 deg",
)

PREDICATES: tuple[Predicate, ...] = (
    Predicate("region", About.AGENT, ("region",), "the agent's centre is in the region or on its border", "field"),
    Predicate(
        "inside",
        About.AGENT,
        ("region",),
        "the agent's whole body is in the region",
        "inside(field)",
        lambda region: Inside(region, body=True),
    ),
    Predicate(
        "touches",
        About.AGENT,
        ("region",),
        "some part of the agent's body is in the region",
        "touches(field)",
        Touches,
    ),
    Predicate("member", About.AGENT, ("agents",), "the agent is one of the listed agents", "drone[0..2]"),
    Predicate(
        "compare",
        About.EITHER,
        ("linear expression", "linear expression"),
        "an inequality, linear in the state of one agent, or in distances between two named agents",
        "distance(base) <= 2 m",
    ),
    Predicate(
        "connected",
        About.TEAM,
        ("graph", "agents?", "a number?"),
        "each agent has a route to each other agent on the graph, also after the loss of fewer agents than the number",
        "connected(radio, east)",
        Connected,
    ),
    Predicate("formation", About.TEAM, ("formation",), "every edge of the formation is within its tolerance", "wall"),
    Predicate(
        "flag",
        About.AGENT,
        ("flag",),
        "the agent visited the region that sets the flag, and has not visited the one that clears it since then",
        "loaded",
    ),
    HEADING,
)
"""All predicates of the language. To add one, define its meaning in ``ir.predicates`` and its vocabulary here."""
