"""Registry of predicates written with their name and brackets: built-in ones and those of extensions."""

from __future__ import annotations

import math

from missionc.base.extensions import Kind, Registry, Unfit
from missionc.frontend.syntax.tokens import SPELLINGS, STATES
from missionc.ir import About
from missionc.ir.language.predicates import PREDICATES, Predicate
from missionc.ir.predicates.place_predicate import PARAMETERS, PlacePredicate


def of_class(name: str, kind: object) -> Predicate:
    """Predicate of an extension, with the wording from its class.

    Raises:
        Unfit: it is not a class of predicates with its full wording.
    """
    if not (isinstance(kind, type) and issubclass(kind, PlacePredicate)):
        raise Unfit("a predicate is a class that extends `PlacePredicate`")
    if kind.value is PlacePredicate.value:
        raise Unfit("its class has no `value`")
    if name in SPELLINGS or name in STATES:
        raise Unfit("its name is a keyword")
    if not getattr(kind, "says", "") or not getattr(kind, "example", "").startswith(f"{name}("):
        raise Unfit(f"its class needs `says` and an `example` that begins with `{name}(`")
    unknown = [each for each in kind.parameters if each not in PARAMETERS]
    if unknown or not kind.parameters:
        wrong = f"`{unknown[0]}` among" if unknown else "no"
        raise Unfit(f"its class has {wrong} `parameters`; there are {', '.join(PARAMETERS)}")
    if not 0 < kind.slope < math.inf:
        raise Unfit("its `slope` is not a number above 0")
    return Predicate(name, About.AGENT, kind.parameters, kind.says, kind.example, kind)


CALLED = Registry(Kind.PREDICATE, {predicate.name: predicate for predicate in PREDICATES if predicate.called}, of_class)
"""All such predicates by name."""
