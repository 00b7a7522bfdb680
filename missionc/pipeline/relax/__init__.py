"""What would make an infeasible mission feasible: changes of its text, each tried and verified.

in   Checked, and the requirements in conflict
out  Explained: who is to blame, the changes that do, and the nearest miss
"""
