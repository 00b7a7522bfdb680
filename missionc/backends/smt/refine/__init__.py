"""Lazy constraint generation (CEGAR): collisions are forbidden once a model contains them; unsatisfiable cores."""
