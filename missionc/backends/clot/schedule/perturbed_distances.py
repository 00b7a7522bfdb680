"""Random perturbation of travel times for restarts: each schedule takes ways and delays to be a little different."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from missionc.backends.clot.schedule.tasks import Event
from missionc.ir.kernel.nodes import Node


@dataclass(frozen=True, slots=True)
class PerturbedDistances:
    """Perturbed distances and delays for one schedule: the true ones where ``noise`` is 0.

    ``stretch`` is how many times as long the way to each event is taken to be;
    ``delay`` the share of the time it has by which each event without a region is put off.
    """

    noise: float
    generator: np.random.Generator
    stretch: dict[tuple[Node, int, int], float] = field(default_factory=dict)
    delay: dict[tuple[Node, int, int], float] = field(default_factory=dict)

    def factor(self, event: Event) -> float:
        key = event.chooser, event.agent, event.step
        if self.noise and key not in self.stretch:
            self.stretch[key] = float(np.exp(self.noise * self.generator.standard_normal()))
        return self.stretch[key] if self.noise else 1.0

    def put_off(self, event: Event) -> float:
        """From 0, as early as can be, which it is in one case of three, to 1, as late as can be."""
        key = event.chooser, event.agent, event.step
        if self.noise and key not in self.delay:
            self.delay[key] = max(0.0, float(self.generator.uniform(-0.5, 1.0)))
        return self.delay.get(key, 0.0)
