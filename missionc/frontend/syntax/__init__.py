"""Syntax: from text to the abstract syntax tree, without name lookup."""
