"""Cover method: an over-approximation of all trajectories, whose refusal proves that none satisfies the mission."""
