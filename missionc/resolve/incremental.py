"""Incremental resolution: what means the same as in the text before it was changed is the same object.

So whoever looks at one version after the other, as an editor does, knows by identity what need not be looked at again.
"""

from __future__ import annotations

from dataclasses import field
from typing import Any, Protocol, TypeVar

from missionc.base.late_dataclass import dataclass
from missionc.resolve.typed import Typed
from missionc.syntax.references import Mentions


class Thing(Protocol):
    """What a mission declares by name, known apart by identity."""

    @property
    def name(self) -> str: ...


T = TypeVar("T", bound=Thing)


class Written:
    """A part of the tree as written, as a key: the same where it is the same object."""

    __slots__ = ("part",)

    def __init__(self, part: object) -> None:
        self.part = part

    def __hash__(self) -> int:
        return id(self.part)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Written) and self.part is other.part


@dataclass(frozen=True, slots=True)
class Body:
    """What a formula as written meant.

    ``rests_on`` is what the names in it stood for, with all else that a formula's meaning rests on;
    ``members`` is how many agents it named by ranges, spelt out.
    """

    rests_on: tuple[object, ...]
    meant: Typed
    members: int


@dataclass(slots=True)
class Meanings:
    """One version of a mission: its things by kind and name; by what is written formulas, and what it mentions."""

    things: dict[tuple[type, str], Any] = field(default_factory=dict)
    bodies: dict[Written, Body] = field(default_factory=dict)
    mentions: dict[Written, Mentions] = field(default_factory=dict)

    def forgotten(self) -> Meanings:
        """All of it, and nothing stays here: the next version takes from it what is still so."""
        before = Meanings(self.things, self.bodies, self.mentions)
        self.things, self.bodies, self.mentions = {}, {}, {}
        return before

    def thing(self, new: T) -> T:
        """The same thing as it was before, or the new one."""
        before = self.things.get((type(new), new.name))
        fields: tuple[str, ...] = type(new).__match_args__  # type: ignore[attr-defined]
        if before is None or any(getattr(before, name) != getattr(new, name) for name in fields):
            return new
        return before  # type: ignore[no-any-return]
