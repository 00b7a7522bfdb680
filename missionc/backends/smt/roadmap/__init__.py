"""Probabilistic roadmaps (PRM): sampled nodes, steerable edges, unrolled over time, with labels. [strel]"""
