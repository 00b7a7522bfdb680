"""Parts of missions in Python: operators, conversions, and errors that name what to write."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

import missionc
from missionc.frontend.builder import parts
from missionc.frontend.builder.functions import connected, distance, heading, inside, maximum, minimum, state
from missionc.frontend.builder.parts import Agents, Formula, Quantity, Region, agents, formula, quantity, shape
from missionc.frontend.syntax import ast
from missionc.ir.language.operators import OPERATORS
from tests.support.random_trees import NOWHERE

BASE, FIRE = (Region(ast.Name(NOWHERE, name)) for name in ("base", "fire"))
DRONE = Agents(ast.Name(NOWHERE, "drone"))
T = Quantity(ast.Name(NOWHERE, "T"))


@pytest.mark.parametrize(
    ("part", "text"),
    [
        (BASE & ~FIRE, "base and not fire"),
        (BASE | FIRE & True, "base or fire and true"),
        (BASE & FIRE & BASE, "base and fire and base"),
        (BASE >> (FIRE >> BASE), "base implies fire implies base"),
        (BASE.iff(FIRE), "base iff fire"),
        (BASE.always(0, T), "always[0, T] base"),
        (BASE.eventually("2 steps", "end"), "eventually[2 steps, end] base"),
        (BASE.until(FIRE, 0, T + 3), "base until[0, T + 3] fire"),
        (BASE.every(40), "every 40: base"),
        ((~FIRE).reach(BASE, hops=(0, 2), on="radio"), "not fire reach[hops 0..2 on radio] base"),
        (BASE.somewhere(distance=5), "somewhere[distance <= 5] base"),
        (BASE.escape(delay=(1, None)), "escape[delay 1..] base"),
        (BASE.count(hops=1) >= 2, "count[hops <= 1] base >= 2"),
        (BASE.count(hops=1) == 2, "count[hops <= 1] base = 2"),
        (DRONE.every(BASE.next()), "every drone: next base"),
        (DRONE.at_least(2, "base or fire"), "at least 2 drone: base or fire"),
        (DRONE.without_any(1, connected("radio", DRONE)), "without any 1 drone: connected(radio, drone)"),
        (DRONE[0].satisfies(inside(BASE)), "drone[0]: inside(base)"),
        (DRONE[0:3].some(BASE), "some drone[0..2]: base"),
        (BASE.for_some(i=(0, T)), "for some i in 0..T: base"),
        (distance(BASE) <= 2 * (T + "1 m"), "distance(base) <= 2 * (T + 1 m)"),
        (distance(DRONE[0], DRONE[1]) > 0.3, "distance(drone[0], drone[1]) > 0.3"),
        (state.speed <= 3, "speed <= 3"),
        (np.float64(3) >= state.speed, "speed <= 3"),
        (heading("10 deg", of="90 deg"), "heading within 10 deg of 90 deg"),
        (minimum(T, 3) - maximum(T, -1), "min(T, 3) - max(T, -1)"),
        (quantity(0.1 + 0.2), "0.3"),
        (-T / 2, "-T / 2"),
        (BASE - FIRE + shape("box (0, 0) to (1, 1)"), "base - fire + box (0, 0) to (1, 1)"),
        (agents("cart")[1][0], "cart[1][0]"),
        (BASE[0, T] & agents("cart")[1, 2], "base[0, T] and cart[1, 2]"),
    ],
)
def test_a_part_prints_as_the_language_writes_it(part: parts.Part, text: str) -> None:
    assert str(part) == text


def test_every_operator_of_the_language_can_be_written_in_python() -> None:
    by_sign = {"and", "or", "not"}
    assert all(operator.name in by_sign or callable(getattr(Formula, operator.name)) for operator in OPERATORS)
    assert "safe reach[hops 0..2 on radio] base" in (Formula.reach.__doc__ or "")


@pytest.mark.parametrize(
    ("wrong", "error", "words"),
    [
        (lambda: BASE and FIRE, TypeError, "write `&` for `and`"),
        (lambda: not BASE, TypeError, "`~` for `not`"),
        (lambda: 0 <= state.x <= 3, TypeError, r"\(a <= x\) & \(x <= b\)"),
        (lambda: BASE == FIRE, TypeError, r"`\.iff\(…\)`"),
        (lambda: state.speed == 1, TypeError, "`<=` or `>=`"),
        (lambda: BASE & 3, TypeError, "expected a formula, such as `base & ~fire`, found 3"),
        (lambda: formula(T), TypeError, "a formula"),  # type: ignore[arg-type]
        (lambda: DRONE.every(BASE.count(hops=1)), TypeError, "a formula"),
        (lambda: BASE.always(0), TypeError, r"missing a required argument: 'high'; in the language: `always"),
        (lambda: BASE.reach(FIRE), TypeError, "takes one length"),
        (lambda: BASE.reach(FIRE, hops=(None, None)), ValueError, "one end may be None"),
        (lambda: formula("base andd fire"), ValueError, "MC008: unknown operator `andd`"),
        (lambda: formula("base\nrequire fire"), ValueError, "more than one part"),
        (lambda: quantity(math.nan), ValueError, "a finite number"),
        (lambda: quantity(10**400), ValueError, "a finite number"),
        (lambda: quantity(True), TypeError, "a number"),
        (lambda: parts.point(3), TypeError, "expected a point"),  # type: ignore[arg-type]
        (lambda: parts.declared_name("my shelf"), ValueError, "invalid name `my shelf`"),
        (lambda: list(DRONE), TypeError, "not iterable"),  # type: ignore[call-overload]
        (lambda: list(BASE), TypeError, "not iterable"),  # type: ignore[call-overload]
        (lambda: (BASE & FIRE)[0], TypeError, "only a family has members"),
        (lambda: DRONE[1:], TypeError, "write both ends"),
        (lambda: DRONE[0][1][2], TypeError, "no members of its own"),
        (lambda: state.height, AttributeError, "unknown state `height`"),
        (lambda: missionc.nothing, AttributeError, "nothing"),
    ],
)
def test_a_wrong_part_raises_an_error_that_says_what_to_write(
    wrong: Callable[[], object], error: type[Exception], words: str
) -> None:
    with pytest.raises(error, match=words):
        wrong()


def test_a_part_that_grows_without_bound_is_refused_and_a_long_chain_is_not() -> None:
    chain: Formula = BASE
    for _ in range(1000):
        chain = chain & FIRE
    assert str(chain).count("fire") == 1000
    deep: Formula = BASE
    for _ in range(255):
        deep = deep.next()
    with pytest.raises(ValueError, match=r"257 operators deep; name its inner parts with `Mission\.let`"):
        deep.next()
    wide: Formula = BASE
    for _ in range(18):
        wide = wide >> wide
    with pytest.raises(ValueError, match="a part of 1048575 operators"):
        wide >> wide
