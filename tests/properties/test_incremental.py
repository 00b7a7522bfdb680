"""What is kept of a text from one check to the next changes nothing in what is said of it."""

from __future__ import annotations

import gc
import random
import re
from dataclasses import replace
from enum import Enum
from pathlib import Path

import pytest

from missionc.base.limits import Limits
from missionc.base.source import Source, Span
from missionc.checks.necessary_conditions import necessary_conditions
from missionc.diagnostics.render import render_json
from missionc.pipeline.checked import Checked
from missionc.pipeline.front_end import Kept, check
from missionc.syntax.passages import passages
from tests.support.typed_edits import typed

ROOT = Path(__file__).resolve().parents[2]
CORPUS = [
    path.read_text(encoding="utf-8")
    for path in (*sorted((ROOT / "missions").glob("*.mission")), *sorted((ROOT / "missions/gallery").glob("*.mission")))
]
EDITS = 12
NUMBER = re.compile(r"(?<![\w.])\d+(?:\.\d+)?")
WORD = re.compile(r"\b[a-z_]{4,}\b")


def edited(text: str, chance: random.Random) -> str:
    """The text after a change that often leaves a whole mission."""
    cuts = [text[begin:end] for begin, end in passages(text)]
    place = chance.randrange(len(cuts))
    match chance.randrange(7):
        case 0 | 1:
            number = chance.choice(list(NUMBER.finditer(text)))
            value = chance.choice(["0", "1", "3", str(2 * float(number[0])), str(float(number[0]) / 2)])
            return text[: number.start()] + value + text[number.end() :]
        case 2:
            chance.shuffle(cuts)
        case 3:
            del cuts[place]
        case 4:
            cuts.insert(chance.randrange(len(cuts)), cuts[place])
        case 5:
            word = chance.choice(WORD.findall(text))
            return re.sub(rf"\b{word}\b", chance.choice([f"{word}_2", chance.choice(WORD.findall(text))]), text)
        case _:
            return typed(text, chance)
    return "".join(cuts)


def spelt(root: object, known: dict[int, int]) -> object:
    """A value with all that is in it, spans by their places; an object that occurs again by when it occurred first."""
    match root:
        case Span(source, start, end):
            return source.name, start, end, source.text[start:end]
        case Enum():
            return root.name
        case tuple() | frozenset():
            return type(root).__name__, *(
                spelt(part, known) for part in (sorted(root) if isinstance(root, frozenset) else root)
            )
        case dict():
            return tuple((spelt(key, known), spelt(value, known)) for key, value in root.items())
        case _ if hasattr(root, "__match_args__"):
            if type(root).__eq__ is object.__eq__:
                if id(root) in known:
                    return "again", known[id(root)]
                known[id(root)] = len(known)
            parts = (spelt(getattr(root, name), known) for name in type(root).__match_args__ if name != "operator")
            return type(root).__name__, *parts
        case _:
            return root


def said(checked: Checked) -> object:
    known: dict[int, int] = {}
    kernel = checked.kernel and (checked.kernel.requirements, checked.kernel.preferences)
    meant = spelt(checked.mission, known) if checked.mission else None
    return render_json(checked.findings), checked.choice, meant, spelt(kernel, known)


@pytest.mark.parametrize("number", range(len(CORPUS)))
def test_a_text_that_is_checked_after_each_edit_is_checked_as_one_that_is_new(number: int) -> None:
    chance = random.Random(number)
    kept = Kept()
    text = CORPUS[number]
    for _ in range(EDITS):
        after = edited(text, chance)
        again = check(Source("edited.mission", after), kept=kept)
        assert said(again) == said(check(Source("edited.mission", after))), after
        text = after if again.mission or chance.random() < 0.3 else CORPUS[number]


def test_what_still_means_the_same_is_the_same_object() -> None:
    text = (ROOT / "missions" / "wildfire.mission").read_text(encoding="utf-8")
    kept = Kept()
    before = check(Source("a.mission", text), kept=kept).mission
    after = check(Source("a.mission", f"# new\n{text}region spot = disc at (2, 2) radius 0.5\n"), kept=kept).mission
    assert before is not None
    assert after is not None
    assert after is not before
    assert len(after.regions) == len(before.regions) + 1
    assert all(one is other for one, other in zip(before.regions, after.regions, strict=False))
    pairs = list(zip(before.requirements, after.requirements, strict=True))
    assert pairs
    assert all(one.formula is other.formula for one, other in pairs)
    assert all(other.formula.span.start > text.index("require") for _, other in pairs)


def test_what_rests_on_something_that_changed_is_new() -> None:
    text = (ROOT / "missions" / "wildfire.mission").read_text(encoding="utf-8")
    kept = Kept()
    before = check(Source("a.mission", text), kept=kept).mission
    after = check(Source("a.mission", text.replace("box (1, 1)", "box (0.9, 1)")), kept=kept).mission
    assert before is not None
    assert after is not None
    asked = [one.formula is other.formula for one, other in zip(before.requirements, after.requirements, strict=True)]
    uses = ["base" in goal.span.text for goal in before.requirements]
    assert any(uses)
    assert not any(same for same, used in zip(asked, uses, strict=True) if used)


HALL = """mission hall
time step 1 s, horizon 20 s
world (0, 0) to (10, 10)
region base = box (1, 1) to (3, 3)
region goal = box (6, 6) to (8, 8)
region gap = box (4.6, 1) to (5, 2)
obstacle wall = box (4, 0) to (4.5, 4)
team drone[2] {
  radius 0.1 m
  dynamics single_integrator(speed <= 2 m/s)
  start at (2, 2), (2.5, 2)
}
graph radio = proximity 3 m
param far = 2 m
let near = distance(goal) <= far
require fits: some drone: eventually[0, 12 s] inside(goal)
require come: every drone: eventually[0, 12 s] near
require link: every drone: always[0, 12 s] somewhere[hops 0..2 on radio] base
require meet: eventually[0, 12 s] distance(drone[0], drone[1]) <= 0.6 m
require pass: some drone: eventually[0, 12 s] gap
require stay: drone[0]: always[2 s, end] base
require away: drone[0]: eventually[2 s, end] goal
"""


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("step 1 s, horizon 20 s", "step 2 s, horizon 40 s"),
        ("horizon 20 s", "horizon 22 s"),
        ("(0, 0) to (10, 10)", "(0, 0) to (10, 7)"),
        ("(0, 0) to (10, 10)", "(0, 0) to (5, 5)"),
        ("box (4, 0) to (4.5, 4)", "box (5.5, 5.5) to (8.5, 8.5)"),
        ("box (4, 0) to (4.5, 4)", "box (1, 1) to (2.1, 2.1)"),
        ("box (6, 6) to (8, 8)", "box (6, 6) to (6.1, 6.1)"),
        ("radius 0.1 m", "radius 1.5 m"),
        ("speed <= 2 m/s", "speed <= 0.1 m/s"),
        ("drone[2] {", "drone[3] {"),
        ("(2.5, 2)", "(9, 9)"),
        ("proximity 3 m", "proximity 1 m"),
        ("far = 2 m", "far = 2 s"),
        ("far = 2 m", "far = 40 m"),
        ("<= far", ">= far"),
        ("region goal", "beacon goal = (7, 7)\nregion else"),
        ("let near", "clearance 1.2 m\nlet near"),
        ("let near", "separation 1 m\nlet near"),
        ("let near", "graph other = proximity 3 m\nlet near"),
    ],
)
def test_an_edit_that_changes_what_is_said_elsewhere_changes_it(old: str, new: str) -> None:
    kept = Kept()
    before, after = HALL, HALL.replace(old, new)
    assert after != before
    outcomes = [(text, check(Source("a.mission", text), kept=kept)) for text in (before, after)]
    assert said(outcomes[1][1]) == said(check(Source("a.mission", after)))
    assert said(check(Source("a.mission", before))) != said(outcomes[1][1])
    assert said(check(Source("a.mission", before), kept=kept)) == said(check(Source("a.mission", before)))


def test_facts_are_of_the_mission_that_is_asked_about() -> None:
    mission = check(Source("a.mission", HALL)).mission
    assert mission is not None
    stay = next(goal.formula for goal in mission.requirements if goal.name == "stay")
    whens = [
        [fact.when for fact in necessary_conditions(replace(mission, steps=steps), stay).facts]
        for steps in (20, 30, 20)
    ]
    assert whens[0] == whens[2] != whens[1]


SMALL_HALL = HALL[: HALL.index("param far")]
MANY = "".join(
    f"require r{n}: some drone: eventually[0, 5 s] distance(base) <= {1 + n / 1000:g} m\n" for n in range(520)
)
TINY = "region tiny = disc at (8, 8) radius 0.1 m\n"
IN_TINY = "require t: some drone: eventually[0, 5 s] inside(tiny)\n"
WIDE = SMALL_HALL.replace("radius 0.1 m", "radius 0.6 m").replace("(2.5, 2)", "(4, 6)") + TINY
THREE = SMALL_HALL.replace("drone[2]", "drone[n]").replace("at (2, 2), (2.5, 2)", "at (2, 2), (2.5, 2), (2.9, 2)")


@pytest.mark.parametrize(
    ("versions", "nodes"),
    [
        pytest.param(
            (f"{SMALL_HALL}require q: a\nlet a = not b\nlet b = not a\n", f"{SMALL_HALL}require q: a\n"),
            None,
            id="names-on-a-cycle-that-go",
        ),
        pytest.param(
            (
                f"{SMALL_HALL}require q: every a: base\ngroup a = b\ngroup b = a\n",
                f"{SMALL_HALL}require q: every a: base\n",
            ),
            None,
            id="groups-on-a-cycle-that-go",
        ),
        pytest.param(
            (
                f"{SMALL_HALL}require r: every drone[0..1]: eventually[0, 5 s] base\n"
                "group big = drone[0..1], drone[0..1], drone[0..1], drone[0..1]\nrequire s: every big: base\n",
                f"{SMALL_HALL}require r: every drone[0..1]: eventually[0, 5 s] base\n",
            ),
            7,
            id="more-members-than-there-is-room-for",
        ),
        pytest.param(
            tuple(f"{THREE}require r: drone[3]: eventually[0, 5 s] base\nparam n = {n}\n" for n in (4, 2)),
            None,
            id="a-team-of-another-size-whose-places-do-not-fit",
        ),
        pytest.param((WIDE + MANY + IN_TINY, WIDE + IN_TINY + MANY), None, id="more-predicates-than-are-looked-at"),
        pytest.param((WIDE + IN_TINY + MANY, WIDE + MANY + IN_TINY), None, id="and-the-other-way-round"),
    ],
)
def test_what_went_wrong_before_is_not_believed_after_it(versions: tuple[str, ...], nodes: int | None) -> None:
    limits = Limits() if nodes is None else Limits(formula_nodes=nodes)
    kept = Kept()
    said_before = []
    for text in versions:
        again = said(check(Source("a.mission", text), limits=limits, kept=kept))
        assert again == said(check(Source("a.mission", text), limits=limits))
        said_before.append(again)
    assert said_before[0] != said_before[1]


def test_texts_that_were_typed_are_let_go() -> None:
    kept = Kept()
    for number in range(40):
        check(Source("let_go.mission", HALL.replace("box (6, 6)", f"box (6, {number / 10:g})")), kept=kept)
    gc.collect()
    held = [each for each in gc.get_objects() if type(each) is Source and each.name == "let_go.mission"]
    assert sum(len(each.text) for each in held) <= 3 * len(HALL)
