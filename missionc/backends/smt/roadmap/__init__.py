"""Probabilistic roadmaps (PRM): sampled nodes, steerable motions, unrolled to steps, labelled. [strel]"""
