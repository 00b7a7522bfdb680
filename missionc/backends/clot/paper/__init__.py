"""The paper's Algorithms 1 and 2 as published: transport of trajectories, tree search over sequences. [clot]"""
