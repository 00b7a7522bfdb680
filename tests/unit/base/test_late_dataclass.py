"""Classes whose methods are made late are those of the standard library in all but when."""

from __future__ import annotations

import copy
import dataclasses
import inspect
import pickle
from collections.abc import Callable
from dataclasses import field
from typing import Any, ClassVar
from weakref import ref

import pytest

from missionc.base import late_dataclass
from missionc.base.late_dataclass import FEW


def plain() -> type:
    class Written:
        first: int
        second: str = "b"
        third: list[int] = field(default_factory=list)

    return Written


def marked() -> type:
    class Written:
        name: str
        hidden: int = field(default=0, repr=False, compare=False)
        made: int = field(init=False, default=7)

    return Written


@late_dataclass.dataclass(frozen=True, slots=True)
class Kept:
    first: int
    second: str = "b"


def both(written: Callable[[], type], **options: Any) -> tuple[Any, Any]:
    """A class made late, and by the standard library."""
    late = late_dataclass.dataclass(slots=True, **options)(written())
    return late, dataclasses.dataclass(slots=True, **options)(written())


@pytest.mark.parametrize("options", [{}, {"frozen": True}, {"eq": False}, {"frozen": True, "eq": False}])
@pytest.mark.parametrize("written", [plain, marked])
def test_instances_say_and_hold_the_same(written: Callable[[], type], options: dict[str, bool]) -> None:
    late, known = both(written, **options)
    one, other = late(1), known(1)
    names = [each.name for each in dataclasses.fields(known)]
    assert [each.name for each in dataclasses.fields(late)] == names
    assert [getattr(one, name) for name in names] == [getattr(other, name) for name in names]
    assert repr(one) == repr(other)
    assert (late(1) == late(1)) is (known(1) == known(1))
    assert (late(1) == late(2)) is (known(1) == known(2))
    assert late.__match_args__ == known.__match_args__
    assert late.__slots__ == known.__slots__
    assert inspect.signature(late) == inspect.signature(known)


def test_what_a_class_takes_is_known_before_there_is_an_instance() -> None:
    late, known = both(plain)
    assert inspect.signature(late) == inspect.signature(known)
    again, _ = both(plain)
    bound = again.__dict__["__init__"].__get__(again, type(again))  # as Python 3.13 asks
    assert inspect.signature(bound) == inspect.signature(known)


def test_hashes_follow_what_is_compared() -> None:
    late, known = both(marked, frozen=True)
    assert hash(late("a", 1)) == hash(late("a", 2)) == hash(known("a", 3))
    mutable, _ = both(marked)
    with pytest.raises(TypeError, match="unhashable"):
        hash(mutable("a"))


def test_defaults_are_made_for_each_instance() -> None:
    late, _ = both(plain)
    one, other = late(1), late(first=2, second="c")
    assert (one.second, other.second) == ("b", "c")
    assert one.third == other.third == []
    assert one.third is not other.third


def test_wrong_arguments_are_refused_in_the_library_s_words() -> None:
    for wrong in ((), (1, "b", [], 4)):
        late, known = both(plain)
        with pytest.raises(TypeError) as expected:
            known(*wrong)
        with pytest.raises(TypeError) as found:
            late(*wrong)
        assert str(found.value) == str(expected.value)
    late, _ = both(plain)
    with pytest.raises(TypeError, match="unexpected keyword argument 'fourth'"):
        late(1, fourth=2)
    with pytest.raises(TypeError, match="multiple values for argument 'first'"):
        late(1, first=2)


def test_what_is_frozen_stays() -> None:
    late, _ = both(plain, frozen=True)
    one = late(1)
    with pytest.raises(dataclasses.FrozenInstanceError):
        one.first = 2
    with pytest.raises(dataclasses.FrozenInstanceError):
        del one.first


def test_many_instances_are_all_alike() -> None:
    late, _ = both(plain)
    made = [late(number, third=[number]) for number in range(2 * FEW)]
    assert [(each.first, each.second, each.third) for each in made] == [(n, "b", [n]) for n in range(2 * FEW)]


def test_instances_are_replaced_copied_and_kept() -> None:
    one = Kept(1)
    assert dataclasses.replace(one, second="c") == Kept(1, "c")
    assert dataclasses.asdict(one) == {"first": 1, "second": "b"}
    assert copy.copy(one) == copy.deepcopy(one) == pickle.loads(pickle.dumps(one)) == one


def test_a_class_variable_is_no_field() -> None:
    @late_dataclass.dataclass(frozen=True, slots=True)
    class Titled:
        title: ClassVar[str] = "titled"
        first: int = 1

    assert Titled.title == Titled(2).title == "titled"
    assert [each.name for each in dataclasses.fields(Titled)] == ["first"]
    assert Titled() == Titled(1) != Titled(2)
    assert repr(Titled(2)).endswith("Titled(first=2)")


class Base(late_dataclass.Record):
    place: int


class Below(Base):
    name: str = "b"


def test_subclasses_of_a_record_are_data_classes_that_inherit_its_fields() -> None:
    assert Below.__match_args__ == ("place", "name")
    assert repr(Below(1, "c")) == "Below(place=1, name='c')"
    assert Below(1) == Below(place=1) != Base(1)
    assert len({Below(1), Below(1), Below(2)}) == 2
    assert [each.name for each in dataclasses.fields(Below)] == ["place", "name"]
    assert dataclasses.replace(Below(1), place=2) == pickle.loads(pickle.dumps(Below(2)))
    assert str(inspect.signature(Below)) == "(place: 'int', name: 'str' = 'b') -> None"
    with pytest.raises(dataclasses.FrozenInstanceError):
        Below(1).place = 2  # type: ignore[misc]


class Apart(late_dataclass.Record, eq=False, weakref_slot=True):
    place: int


def test_a_record_without_eq_is_compared_by_its_identity() -> None:
    one, other = Apart(1), Apart(1)
    assert one != other
    assert ref(one)() is one
