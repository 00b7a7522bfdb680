"""Registry of predicates that are written with their name and brackets: built-in ones and those of extensions."""

from __future__ import annotations

import math
import re
from dataclasses import fields

from missionc.base.extensions import Kind, Registry, Unfit
from missionc.frontend.syntax.tokens import SPELLINGS, STATES
from missionc.ir import About
from missionc.ir.language.predicates import PREDICATES, Predicate
from missionc.ir.predicates.place_predicate import PARAMETERS, PlacePredicate

EXAMPLE = re.compile(r"\w+\(.+\)")
"""Pattern that the example of a predicate must match."""


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
    says, example, slope = (getattr(kind, each, None) for each in ("says", "example", "slope"))
    if not (says and isinstance(says, str) and isinstance(example, str) and EXAMPLE.fullmatch(example)):
        raise Unfit("its class needs the texts `says` and `example`; `example` is a call with all arguments")
    if not example.startswith(f"{name}("):
        raise Unfit(f"its `example` does not begin with `{name}(`")
    unknown = [each for each in kind.parameters if each not in PARAMETERS]
    if unknown or not kind.parameters:
        wrong = f"`{unknown[0]}` among" if unknown else "no"
        raise Unfit(f"its class has {wrong} `parameters`; there are {', '.join(PARAMETERS)}")
    own = [each.name for each in fields(kind) if not each.kw_only]
    if len(own) != len(kind.parameters) or any(hasattr(PlacePredicate, each) for each in own):
        few = f"its class has {len(own)} fields and {len(kind.parameters)} `parameters`"
        raise Unfit(f"{few}; each needs a field of its own, without a name of the base class")
    if isinstance(slope, bool) or not isinstance(slope, int | float) or not 0 < slope < math.inf:
        raise Unfit(f"its `slope` is {_slope(slope)}; it needs a number above 0 in the class, for all arguments")
    return Predicate(name, About.AGENT, kind.parameters, kind.says, kind.example, kind)


def _slope(slope: object) -> str:
    return "missing" if slope is None else "a property" if isinstance(slope, property) else f"`{slope!r:.40}`"


CALLED = Registry(Kind.PREDICATE, {predicate.name: predicate for predicate in PREDICATES if predicate.called}, of_class)
"""Registry of all predicates that are written with brackets, by name."""
