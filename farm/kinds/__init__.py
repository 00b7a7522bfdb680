"""Kinds of trials, one module each: their cases, execution, and forbidden results."""
