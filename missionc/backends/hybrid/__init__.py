"""Hybrid planning: SAT on roadmaps for discrete conditions, trajectory optimisation for metric conditions."""
