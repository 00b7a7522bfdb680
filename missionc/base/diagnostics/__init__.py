"""Diagnostics: their codes, findings as values, renderers, and the documentation page of each code."""
