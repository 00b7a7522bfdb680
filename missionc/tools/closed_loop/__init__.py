"""The closed loop in simulation: the engine flies, ground control monitors the reports, replans and uploads."""
