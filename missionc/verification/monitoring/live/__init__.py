"""Online monitoring: a mission judged during flight, by robustness intervals over all continuations."""
