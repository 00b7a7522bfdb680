"""The predicate as data: a value with its name, its subject, its parameters, its wording, and an example.

What it measures, and how it is said, stands with its meaning in ``ir.predicates``.
"""

from __future__ import annotations

from collections.abc import Callable

from missionc import ir
from missionc.base.late_dataclass import dataclass
from missionc.ir import About


@dataclass(frozen=True, slots=True)
class Predicate:
    """``parameters`` are what it is asked with, in order; one that ends in ``?`` may be left out.

    ``called`` predicates are written with their name and brackets
    (``inside(field)``); the others have a form of their own, which ``example`` shows.
    ``about`` is EITHER where the parameters decide. ``meant`` makes its meaning of
    what the parameters name, one that is left out None; of called ones alone.
    """

    name: str
    about: About
    parameters: tuple[str, ...]
    called: bool
    says: str
    example: str
    meant: Callable[..., ir.Predicate] | None = None
