"""Referees of the commands' answers: a second reading of the semantics, and consistency of several answers."""
