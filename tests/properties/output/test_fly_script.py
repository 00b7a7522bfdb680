"""Scripts that fly end safely, whatever happens in a flight, in any order and at any time."""

from __future__ import annotations

import signal
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.support.flown_scripts import (
    SCRIPTS,
    World,
    drain,
    export,
    fly,
    interrupt,
    lose_link,
    raise_in_client,
    safe,
    standing,
    tumble,
)
from tests.support.hand_made_flights import wandered


def hang_up(world: World) -> None:
    """The terminal is closed."""
    signal.raise_signal(signal.SIGHUP)


SIGNALS, REPORTS = (interrupt, hang_up), (drain, tumble)
"""Events that have all vehicles land without delay."""
EVENTS = st.lists(
    st.tuples(st.floats(0, 30), st.sampled_from([*SIGNALS, *REPORTS, lose_link, raise_in_client])),
    min_size=1,
    max_size=4,
)
FAILING = st.dictionaries(
    st.tuples(st.sampled_from(["upload", "arm", "takeoff", "go", "start", "land", "disarm"]), st.sampled_from([0, 1])),
    st.integers(1, 3),
    max_size=2,
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    found = tmp_path_factory.mktemp("scripts")
    for form in SCRIPTS:
        export(form, wandered(2), found)
    return found


@settings(max_examples=50)
@given(st.sampled_from(SCRIPTS), EVENTS, FAILING)
def test_every_flight_ends_safely_and_lands_at_once_when_it_has_to(
    folder: Path,
    form: str,
    events: list[tuple[float, Callable[[World], None]]],
    failing: dict[tuple[str, int], int],
) -> None:
    world = World(standing(wandered(2)), list(events), dict(failing))
    with pytest.MonkeyPatch.context() as patched:
        fly(folder / form / "fly.py", world, patched)
    safe(world)
    if failing or world.interrupts > 1:
        return
    cut = min((time for time, happens in events if happens is lose_link), default=99.0)
    # A vehicle without a link reports nothing.
    when = min(
        (time for time, happens in events if happens in SIGNALS or (happens in REPORTS and time < cut)), default=99
    )
    landing = {each.agent: each.time for each in reversed(world.commands) if each.name == "land"}
    for each in world.commands:
        if each.name == "takeoff" and each.time < when and each.agent not in world.cut_off:
            assert landing[each.agent] <= when + 0.051
