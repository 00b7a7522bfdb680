"""Syntax: text to the abstract syntax tree; no name is looked up here."""
