"""Vocabulary of the mission language: operators (one file per family) and predicates."""
