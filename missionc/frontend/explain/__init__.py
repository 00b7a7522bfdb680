"""Explanation of a mission: sentences, diagrams of its windows, and conventions that tools interpret differently.

in   Mission, resolved
out  words and values; without solving or checking
"""
