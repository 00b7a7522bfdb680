"""The way home of a plan that is kept: whether those who are left can still fly it, and land, in the world as it is.

in   the mission that is left, what is flown of its plan, the way home that was planned with that
out  Certificate
"""

from __future__ import annotations

from collections.abc import Mapping

from missionc.ir import Mission
from missionc.verify.certificate import Certificate
from missionc.verify.flight.verify_whole_flight import verify_whole_flight
from missionc.verify.flight.way_missions import Stage, Ways, is_whole


def way_home(mission: Mission, flown: Mapping[str, str], ways: Ways | None) -> Certificate:
    """The checks of the way home and of the landing; none of a mission that goes to no pads.

    Args:
        flown: the text of the polynomials that each agent flies to the end of its mission, by the agent's name.
        ways: that were planned with them, of lost agents too; None where nothing is known of them.
    """
    if ways is None or not is_whole(mission):
        return Certificate(mission.name, ())
    home = ways.get(Stage.HOME)
    own = {} if home is None else {Stage.HOME: {agent.name: home[agent.name] for agent in mission.agents}}
    return verify_whole_flight(mission, flown, own)
