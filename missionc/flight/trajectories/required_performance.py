"""Required performance of a flight: a note where a team without a vehicle needs more than any profile allows.

in   Mission, the certificate of its polynomials
out  a note, where the flight is harder than any profile allows
"""

from __future__ import annotations

from missionc.ir import PLAIN, Mission
from missionc.ir.vehicle_profiles import profiles
from missionc.verification.certificate import Certificate


def required_performance(mission: Mission, certificate: Certificate) -> tuple[str, ...]:
    """About the largest acceleration of all; the limits of those with a vehicle are kept, or no flight is made."""
    peak = next(figure for figure in certificate.figures if figure.name == "peak acceleration")
    most = max(vehicle.acceleration for vehicle in profiles().values() if vehicle != PLAIN)
    plain = any(agent.name == peak.subject and agent.vehicle == PLAIN for agent in mission.agents)
    if not plain or peak.value <= most:
        return ()
    when = f"{peak.at or 0.0:.2f} s"
    return (
        f"`{peak.subject}` accelerates at {peak.value:.1f} m/s^2 at {when}, and its team names no vehicle; no profile "
        f"allows more than {most:g} m/s^2. `--vehicle NAME` plans for one",
    )
