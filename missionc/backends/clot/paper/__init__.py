"""The paper's Algorithms 1 and 2 as published: optimal transport of trajectories, tree search over sequences. [clot]"""
