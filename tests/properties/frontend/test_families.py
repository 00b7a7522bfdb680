"""A family means what its members mean one by one, and arithmetic what it means to the last decimal."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

from hypothesis import assume, given, settings
from hypothesis import strategies as st

from missionc.base.limits import Limits
from missionc.base.source import Source
from missionc.compiler.front_end import check
from missionc.frontend.resolve.context import Context, collect
from missionc.frontend.resolve.resolve_quantities import resolve_parameters
from missionc.frontend.resolve.show_ir import show_ir
from missionc.frontend.syntax.parse import parse
from tests.support.flat_families import HEAD, MOVES, flat

# ---------------------------------------------------------------- arithmetic


@dataclass(frozen=True)
class Sum:
    """A quantity as text, and what it is."""

    text: str
    value: Fraction


_decimals = st.integers(0, 9999).map(lambda n: f"{n // 100}.{n % 100:02}").map(lambda text: Sum(text, Fraction(text)))


@st.composite
def _larger(draw: st.DrawFn, parts: st.SearchStrategy[Sum]) -> Sum:
    left, right = draw(parts), draw(parts)
    match draw(st.sampled_from(["+", "-", "*", "/", "min", "max", "-()"])):
        case "+":
            return Sum(f"({left.text} + {right.text})", left.value + right.value)
        case "-":
            return Sum(f"({left.text} - {right.text})", left.value - right.value)
        case "*":
            return Sum(f"({left.text} * {right.text})", left.value * right.value)
        case "/" if right.value:
            return Sum(f"({left.text} / {right.text})", left.value / right.value)
        case "min" | "max" as word:
            least, greatest = sorted([left.value, right.value])
            return Sum(f"{word}({left.text}, {right.text})", least if word == "min" else greatest)
        case _:
            return Sum(f"-{left.text}", -left.value)


sums = st.recursive(_decimals, _larger, max_leaves=8)


@given(sums)
def test_arithmetic_is_that_of_fractions(written: Sum) -> None:
    assume(abs(written.value) < 10**9)
    source = Source("sum.mission", f"param a = {written.text}\n")
    program, findings = parse(source, Limits(), lambda path, span: Source(path, ""))
    assert program is not None, findings
    found = Context(collect(program, []), Limits(), [])
    resolve_parameters(found, {})
    if not found.findings:  # a part of it may be too large, or divide by nothing
        assert found.params["a"].exact == written.value
        assert found.params["a"].constant == float(written.value)


# ------------------------------------------------------------------ families


@dataclass(frozen=True)
class Line:
    """``i`` and ``j`` in a sum, as text and as a function of both."""

    i: int
    j: int
    constant: int

    @property
    def text(self) -> str:
        return f"{self.i}*i + {self.j}*j + {self.constant} / 10"

    def at(self, i: int, j: int) -> str:
        """The number as an author would write it."""
        tenths = 10 * (self.i * i + self.j * j) + self.constant
        return f"{tenths // 10}.{tenths % 10}"


_lines = st.builds(Line, st.integers(0, 3), st.integers(0, 3), st.integers(1, 20))


@settings(max_examples=20)
@given(
    st.integers(0, 2), st.integers(0, 2), st.integers(0, 1), st.tuples(_lines, _lines), st.sampled_from(["and", "or"])
)
def test_a_family_means_what_its_members_mean_one_by_one(
    first: int, more: int, columns: int, sizes: tuple[Line, Line], word: str
) -> None:
    rows, columns_of = range(first, first + more + 1), range(columns + 1)
    wide, high = sizes
    some = "some " if word == "or" else ""
    family = f"""param last = {first + more}
region w[i in {first}..last, j in 0..{columns}] = box (i, j) to ({wide.text} + 4, {high.text} + 4)
team t[i in {first}..last][2] {{ {MOVES}  start in w[i, {columns}] }}
let parked[i in {first}..last] = every t[i]: w[i, 0]
require a: eventually[0, 9 s] (for {some}i in {first}..last: parked[i])
require b: for {some}i in {first}..last, j in 0..{columns}: t[i][1]: eventually[0, max(i, j + 1) * 1 s] w[i, j]
require c[i in {first}..last]: every t[i]: always[0, 1 s] not w[last, {columns}] or true
"""
    by_hand = "".join(
        f"region w{i}_{j} = box ({i}, {j}) to ({wide.at(i, j)} + 4, {high.at(i, j)} + 4)\n"
        for i in rows
        for j in columns_of
    )
    by_hand += "".join(f"team t{i}[2] {{ {MOVES}  start in w{i}_{columns} }}\n" for i in rows)
    by_hand += "".join(f"let parked{i} = every t{i}: w{i}_0\n" for i in rows)
    parked = f" {word} ".join(f"parked{i}" for i in rows)
    by_hand += f"require a: eventually[0, 9 s] ({parked})\n"
    each = [f"(t{i}[1]: eventually[0, {max(i, j + 1)} s] w{i}_{j})" for i in rows for j in columns_of]
    by_hand += f"require b: {f' {word} '.join(each)}\n"
    last = f"w{first + more}_{columns}"
    by_hand += "".join(f"require c{i}: every t{i}: always[0, 1 s] not {last} or true\n" for i in rows)
    assert flat(_ir(family), "w", "t", "parked", "c") == _ir(by_hand)


def _ir(text: str) -> str:
    found = check(Source("demo.mission", HEAD + text), backend="any")
    assert found.mission is not None, [(each.code.name, each.message) for each in found.findings]
    return show_ir(found.mission)
