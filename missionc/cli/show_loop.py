"""A flight in a closed loop, shown in the browser while it is flown: its page is fed by what the ground hears."""

from __future__ import annotations

import threading
import time
from contextlib import suppress
from typing import Self

from missionc.base.signals import Stopped
from missionc.base.trace import Array, Trace
from missionc.cli.exit_status import say_line
from missionc.cli.flight_page import FlightPage
from missionc.closed_loop.fly_loop import LoopFlight
from missionc.closed_loop.ground import Ground
from missionc.closed_loop.told import uploaded
from missionc.ir import Mission
from missionc.kernel.nodes import Kernel
from missionc.monitoring.live.session import Session
from missionc.pipeline.checked import Checked
from missionc.pipeline.replan.request import Way


class ShownLoop:
    """A context in which one flight is shown.

    Args:
        mission, kernel: those of the whole flight: its requirements are watched as they were written.
        pace: how many times as fast as the clock it is flown.
    """

    def __init__(self, mission: Mission, kernel: Kernel, plan: Trace, pace: float) -> None:
        self._page, self._plan, self._pace = FlightPage(mission, kernel), plan, pace
        self._session = Session(mission, kernel)
        self._heard = self._told = 0
        self._began = 0.0
        self._world: Checked | None = None

    def __enter__(self) -> Self:
        self._page.__enter__()
        self._page.set_plan(self._plan)
        self._began = time.monotonic()
        return self

    def __exit__(self, *exception: object) -> None:
        self._page.__exit__(*exception)

    @property
    def address(self) -> str:
        return self._page.address

    def listen(self, at: float, position: Array, ground: Ground, lines: list[str]) -> None:
        """What was heard by a time of the flight, and what the ground did; waits until that time has come."""
        for line in lines:
            for event in self._session.feed(line):
                self._page.publish(event)
        if lines:
            self._page.heard(at)
        for happened in ground.happened[self._told :]:
            begins = "" if happened.begins is None else f"; begun at {happened.begins:g} s"
            well = happened.begins is not None or happened.came == Way.KEPT.value
            self._page.tell(f"{happened.why}: {happened.came}{begins}", "good" if well else "risk", at)
        now = ground.world
        if self._world is not None and now is not self._world and now.mission is not None and now.kernel is not None:
            self._page.set_world(now.mission, now.kernel)
        self._world = now
        if len(ground.happened) > self._told:
            self._page.set_plan(uploaded(ground.told, self._plan))
        self._told = len(ground.happened)
        time.sleep(max(0.0, self._began + at / self._pace - time.monotonic()))

    def over(self, flight: LoopFlight) -> None:
        """The flight is over."""
        for event in self._session.finish():
            self._page.publish(event)
        lost = [name for name, kept in flight.outcome.requirements.items() if not kept]
        self._page.end("everything was kept" if not lost else f"not kept: {', '.join(lost)}")

    def wait(self) -> None:
        """Wait for Ctrl-C."""
        say_line("the page stays until Ctrl-C")
        with suppress(KeyboardInterrupt, Stopped):
            threading.Event().wait()
