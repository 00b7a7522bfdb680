"""Relaxation of an infeasible mission: changes of its text that make it feasible, each tried and verified.

in   Checked, and the requirements in conflict
out  Explained: who is to blame, the changes that do, and the nearest miss
"""
