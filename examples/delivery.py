"""Build a mission in Python, plan it for several team sizes, and print the plan of the first that suffices.

python examples/delivery.py
"""

from __future__ import annotations

import missionc
from missionc import box, disc, single_integrator


def delivery(size: int) -> missionc.Mission:
    """Carts bring a parcel from the shelf to the gate, and one of them guards the dock."""
    m = missionc.Mission("delivery")
    m.time(step=1, horizon=12)  # seconds
    m.world((0, 0), (8, 5))  # metres
    dock = m.region("dock", box((0.3, 0.3), (2, 4.7)))
    shelf = m.region("shelf", box((3.5, 3.5), (5, 4.7)))
    gate = m.region("gate", box((6.3, 0.3), (7.7, 2)))
    m.obstacle("pillar", disc((4, 2), 0.6))
    cart = m.team("cart", size, dynamics=single_integrator(speed=1.5), start=dock, radius=0.15)
    m.separation(0.1)

    fetch = shelf & gate.eventually(0, 6)
    m.require(cart.some(fetch.eventually(0, 6)), "fetch")
    m.require(cart.some(dock.always(0, 12)), "guard")
    return m


def main() -> int:
    for size in (1, 2):
        mission = delivery(size)
        checked = missionc.check(mission)
        if not checked.ok:
            print(*(f"{size}: {finding.message}" for finding in checked.findings), sep="\n")
            continue
        compiled = missionc.compile(mission, seed=1, time_limit=60)
        if compiled.word != "planned":
            print(f"{size}: {compiled.word}")
            continue
        print(mission, end="")
        for name, robustness in compiled.robustness.items():
            print(f"{name}: robustness {robustness:.2f}")
        print(f"{size}: {compiled.plan.trace.metres:.1f} m, verified {missionc.verify(compiled).passed}")
        return 0
    return 1


if __name__ == "__main__":
    raise SystemExit(main())
