"""Lazy constraint generation (CEGAR): collisions are forbidden when a model has them; unsat cores."""
