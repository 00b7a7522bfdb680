"""Online monitoring: a mission judged while it is flown, by robustness intervals over all continuations."""
