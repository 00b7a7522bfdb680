"""Lazy constraint generation (CEGAR): collisions are forbidden where a model has them; unsat cores."""
