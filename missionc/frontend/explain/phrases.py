"""Phrases of sentences: verbs for predicates, nouns for agents, adverbials for windows and lengths."""

from __future__ import annotations

import math

from missionc import ir
from missionc.base.late_dataclass import Record
from missionc.base.units import Metric
from missionc.frontend.resolve.show_ir import Words, number_text
from missionc.ir.wording import seconds

MOST_NAMES = 20
"""Maximum number of agents that a phrase lists individually."""


class Verb(Record):
    """Verb phrase of a predicate, such as ``is in `base` ``, and its negation.

    If ``denies`` is True, ``plain`` is the negated phrase. In a format string a noun may follow a colon: ``every NOUN
    is in `base` ``, or ``no NOUN is in `base` `` for a verb that denies.
    """

    plain: str
    denied: str
    denies: bool = False

    def __str__(self) -> str:
        return self.denied if self.denies else self.plain

    def __format__(self, noun: str) -> str:
        return self.of_every(noun) if noun else str(self)

    def of_every(self, noun: str) -> str:
        return f"no {noun} {self.plain}" if self.denies else f"every {noun} {self.plain}"

    def negated(self) -> Verb:
        return Verb(self.plain, self.denied, not self.denies)


class Noun(Record):
    """Noun for agents: ``one`` follows `every` and `no`; ``many`` follows a number; ``this`` refers to an agent named
    before.
    """

    one: str
    many: str
    this: str


def noun(agents: ir.AgentSet, mission: ir.Mission) -> Noun:
    """Noun for the members of a set: the name of a team if it is a word, otherwise "members of …"."""
    is_team = any(team.name == agents.name for team in mission.teams)
    if is_team and agents.name.isalpha() and len(agents.agents) > 1:
        return Noun(agents.name, f"{agents.name}s", f"the {agents.name}")
    return Noun(f"agent of `{agents.name}`", f"agents of `{agents.name}`", f"the agent of `{agents.name}`")


def belongs(agents: ir.AgentSet, mission: ir.Mission) -> Verb:
    if any(agent.name == agents.name for agent in mission.agents):
        return Verb(f"is {agents.name}", f"is not {agents.name}")
    article = "an" if noun(agents, mission).one[0] in "aeiou" else "a"
    return Verb(f"is {article} {noun(agents, mission).one}", f"is not {article} {noun(agents, mission).one}")


class Phrases(Words):
    """Phrases for the predicates of a mission."""

    def agents(self, agents: tuple[int, ...]) -> str:
        return names(agents, self.mission)

    def number(self, value: float) -> str:
        return number_text(value)


def verb_of(predicate: ir.Predicate, mission: ir.Mission) -> Verb | None:
    """Verb phrase of a predicate for one agent, or None if it is about the team."""
    return None if predicate.about_team else Verb(*predicate.phrases(Phrases(mission)))


def of_team(predicate: ir.Predicate, mission: ir.Mission, denied: bool) -> str:
    """Clause for a predicate about the team; with ``denied``, for its negation."""
    return predicate.phrases(Phrases(mission))[denied]


def names(agents: tuple[int, ...], mission: ir.Mission) -> str:
    """Name of a set of agents in the mission, or the names of its members."""
    for known in (*mission.teams, *mission.groups):
        if known.agents == agents:
            return f"`{known.name}`"
    one_by_one = [mission.agents[agent].name for agent in agents[:MOST_NAMES]]
    more = len(agents) - MOST_NAMES
    return joined_phrases([*one_by_one, f"{more:,} more"] if more > 0 else one_by_one, "and")


def joined_phrases(parts: list[str], word: str, separator: str = ",") -> str:
    """Phrases joined as ``a``, ``a and b``, ``a, b and c``; ``word`` replaces "and"."""
    if len(parts) < 2:
        return "".join(parts)
    return f"{f'{separator} '.join(parts[:-1])}{separator if separator != ',' else ''} {word} {parts[-1]}"


# ------------------------------------------------------------- time and length


class When(Record):
    """Time window in steps ahead, or back if negative, as the phrases that a sentence needs.

    If ``from_start`` is True, the window is relative to the mission's first step, so that its bounds are times of the
    mission.
    """

    low: int
    high: int | None
    from_start: bool
    mission: ir.Mission

    def at(self, steps: str) -> str:
        """Adverbial phrase for the window, such as ``at every step from 0 s to 12 s`` for the argument ``every step``.

        A single step is ``at 12 s``.
        """
        if self.low < 0 and self.high is not None:
            return self._back(steps, seconds(self.mission, -self.low), -self.high)
        low = seconds(self.mission, self.low)
        if self.low == self.high:
            if self.from_start:
                return f"at {low}"
            return f"{low} later" if self.low else "at that same step"
        return f"at {steps} from {self._from(low)} to {self._to()}"

    def _back(self, steps: str, furthest: str, nearest: int) -> str:
        """Adverbial phrase for a past window, such as ``at some step from 5 s before to then``, or ``5 s before``."""
        if self.low == self.high:
            return f"{furthest} before"
        return (
            f"at {steps} from {furthest} before to {f'{seconds(self.mission, nearest)} before' if nearest else 'then'}"
        )

    def _from(self, low: str) -> str:
        if self.from_start:
            return low
        if self.low:
            return low if self.high is not None else f"{low} later"
        return "then"

    def _to(self) -> str:
        if self.high is None:
            end = f" ({seconds(self.mission, self.mission.steps)})" if self.from_start else ""
            return f"the end of the mission{end}"
        return seconds(self.mission, self.high) + ("" if self.from_start else " later")

    @property
    def before(self) -> str:
        if self.low < 0:
            return "after it up to then"
        return f"from {self.start} until just before it"

    @property
    def start(self) -> str:
        return "0 s" if self.from_start else "then"

    @property
    def adverbials(self) -> dict[str, str]:
        """Adverbial phrases for the placeholders in an operator's sentence.

        A period is evaluated at each step to the end, from its length on.
        """
        return {
            "each": self.at("every step"),
            "some": self.at("some step"),
            "before": f"at every step {self.before}",
            "earlier": f"at some step {self.before}",
            "period": seconds(self.mission, self.low),
            "start": self.start,
        }


def length_words(length: ir.Length) -> str:
    """Text for the bounds of a route's length, such as ``at most 2 hops``, ``1 to 2 hops``, ``at least 3 m``."""
    low, high = number_text(length.low), number_text(length.high) if math.isfinite(length.high) else ""
    if length.weight is not None:
        return f"`{length.word}` {_amount(length, low, high)}"
    hops = length.metric is Metric.HOPS
    unit = (" hop" if (high or low) == "1" else " hops") if hops else " m"
    return _amount(length, low, high) + unit


def _amount(length: ir.Length, low: str, high: str) -> str:
    if not high:
        return f"at least {low}"
    if length.low <= 0:
        return f"at most {high}"
    return f"exactly {low}" if low == high else f"{low} to {high}"


def route_words(length: ir.Length) -> str:
    """Text for a route with bounds on its length, such as ``a route of at most 2 hops on `radio` ``."""
    if length.low <= 0 and not math.isfinite(length.high):
        measured = " in metres" if length.metric is Metric.METRES else ""
        return f"a route of any length{measured} on `{length.graph.name}`"
    return f"a route of {length_words(length)} on `{length.graph.name}`"


COMPARED = {">=": "at least {}", ">": "more than {}", "<=": "at most {}", "<": "fewer than {}", "=": "exactly {}"}
"""Text for each comparison of a number of agents, with a placeholder for the number."""


def who_of(formula: ir.AtLeastOf, members: Noun) -> str:
    """Subject of a quantified sentence, such as ``every drone``."""
    if formula.kind == "every":
        return f"every {members.one}"
    if formula.kind == "some":
        return f"at least one {members.one}"
    return f"each of at least {formula.number} {members.one if formula.number == 1 else members.many}"


def losing(number: int, agents: ir.AgentSet, members: Noun, mission: ir.Mission) -> str:
    """Phrase for the loss of any ``number`` of some agents."""
    if number == len(agents.agents):
        return f"without {names(agents.agents, mission)}"
    if number == 1:
        return f"whichever one {members.one} is lost"
    return f"whichever {number} {members.many} are lost"


def window_of(when: When, each: bool, formula: ir.AtLeastOf) -> str:
    """Adverbial phrase for the window of a quantified formula, in which each agent may have its own step."""
    own = "" if formula.kind == "some" else " of its own"
    return when.at("every step" if each else f"some step{own}")
