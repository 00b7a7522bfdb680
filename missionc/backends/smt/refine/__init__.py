"""Refinement by lazy constraints: collisions are forbidden where a model has them; unsat cores."""
