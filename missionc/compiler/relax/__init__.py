"""Relaxation of an infeasible mission: changes of its text that make it feasible, each verified.

in   Checked, and the requirements in conflict
out  Explained: the cause, the sufficient changes, and the closest infeasible candidate
"""
