"""Numerical tolerances of the checks. Every check of the certificate repeats its own."""

MOTION = 1e-6
"""Metres, m/s, m/s² or rad: agreement of states with the dynamics, and of places with what was asked exactly."""

CONTACT = 1e-9
"""Metres: bodies that keep all of a distance but this much keep it; touching is allowed, rounding is not a defect."""

CERTAIN = 1e-5
"""Metres: how far below the least margin seen the proof for the time in between may stay."""

TUBE = 0.1
"""Metres: how far a polynomial may stray from the verified motion."""

WAYPOINT = 5e-3
"""Metres: how far from a step's position a polynomial may be at its time, where the mission is judged once more."""

ROUNDING = 1e-5
"""Metres: what the float32 numbers of a polynomial may cost of a required distance."""

CLOCK = 1e-6
"""Seconds, for each second of the mission: durations are float32 numbers too."""
