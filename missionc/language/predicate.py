"""The predicate as data: a value with its name, its subject, its parameters, its wording, and an example.

Its margin, the signed distance to the border of its truth, is the module of
the same name in ``margins``.
"""

from __future__ import annotations

from missionc.base.late_dataclass import dataclass
from missionc.ir import About


@dataclass(frozen=True, slots=True)
class Predicate:
    """``parameters`` are what it is asked with, in order; one that ends in ``?`` may be left out.

    ``called`` predicates are written with their name and brackets
    (``inside(field)``); the others have a form of their own, which ``example`` shows.
    ``about`` is EITHER where the parameters decide.
    """

    name: str
    about: About
    parameters: tuple[str, ...]
    called: bool
    says: str
    example: str
