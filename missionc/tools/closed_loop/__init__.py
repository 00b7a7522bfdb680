"""Closed-loop simulation: the engine flies, ground control evaluates the reports, replans and uploads."""
