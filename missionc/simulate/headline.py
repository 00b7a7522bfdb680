"""The headline of simulated flights: what they show of all flights like them, and no more."""

from __future__ import annotations

from missionc.base.figures import counted
from missionc.simulate.trials import Trials


def headline(trials: Trials) -> str:
    """The lower bound of the share of flights that are as required; of flights that are all alike, how the one went."""
    kept = trials.kept
    if kept.flights == 1 or not trials.trial.disturbance.random:
        verdict = "as required" if kept.held else "not as required"
        if kept.flights == 1:
            return f"one flight, {verdict}"
        return f"{counted(kept.flights, 'flight')}, all alike since nothing is drawn, {verdict}"
    return (
        f"in at least {shown(kept.least)} of such flights (one-sided 95 % lower confidence bound) "
        f"every requirement holds, nobody is too far off and nothing touched: {kept.held} of {kept.flights}"
    )


def shown(share: float) -> str:
    """A lower bound in percent, rounded down to a tenth."""
    return f"{int(share * 1000) / 10:.1f} %"
