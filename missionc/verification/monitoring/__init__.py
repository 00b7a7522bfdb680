"""Runtime monitoring: trace and kernel formula to truth and robustness."""
