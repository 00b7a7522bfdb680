"""Diagnostics: codes, findings as values, renderers, explanations."""
