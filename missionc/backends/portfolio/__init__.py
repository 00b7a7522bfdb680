"""The portfolio: several engines take turns, and the first plan wins."""
