"""The loop closed in simulation: the engine flies, the ground watches what is reported, plans anew and uploads."""
