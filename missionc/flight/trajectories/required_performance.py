"""Required performance of a flight: a note if a team without a vehicle needs more than any profile allows.

in   Mission, the certificate of its polynomials
out  a note if the flight exceeds every profile
"""

from __future__ import annotations

from missionc.ir import PLAIN, Mission
from missionc.ir.vehicle_profiles import profiles
from missionc.verification.certificate import Certificate


def required_performance(mission: Mission, certificate: Certificate) -> tuple[str, ...]:
    """Note on the largest acceleration if an agent without a vehicle exceeds every profile, as a tuple.

    Empty if not.
    """
    peak = next(figure for figure in certificate.figures if figure.name == "peak acceleration")
    most = max(vehicle.acceleration for vehicle in profiles().values() if vehicle != PLAIN)
    plain = any(agent.name == peak.subject and agent.vehicle == PLAIN for agent in mission.agents)
    if not plain or peak.value <= most:
        return ()
    when = f"{peak.at or 0.0:.2f} s"
    return (
        f"`{peak.subject}` accelerates at {peak.value:.1f} m/s^2 at {when}, and its team names no vehicle; no profile "
        f"allows more than {most:g} m/s^2. Add `--vehicle NAME`",
    )
