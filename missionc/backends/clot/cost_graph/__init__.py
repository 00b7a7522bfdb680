"""The cost graph: kernel formulas as terms with exact robustness that a planner can push on."""
