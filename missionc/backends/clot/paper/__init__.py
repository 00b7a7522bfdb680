"""Algorithms 1 and 2 of the paper as published: optimal transport of trajectories, tree search over sequences.
[clot]"""
