"""Proofs of bounds: the minimum margin of a claim by branch and bound over parts of a flight."""
