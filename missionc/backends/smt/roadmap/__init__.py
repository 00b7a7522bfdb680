"""Probabilistic roadmaps (PRM): nodes sampled, joined by steerable motions, unrolled to steps, labelled. [strel]"""
