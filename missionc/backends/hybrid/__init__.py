"""Hybrid planning: SAT on roadmaps for what is counted, trajectory optimisation for what is measured."""
