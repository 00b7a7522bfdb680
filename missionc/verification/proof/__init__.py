"""Proofs of bounds: the least margin of a claim by branch and bound over parts of a flight."""
