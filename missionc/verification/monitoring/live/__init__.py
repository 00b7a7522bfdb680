"""Online monitoring: evaluation of a mission during flight, by robustness intervals over all continuations."""
