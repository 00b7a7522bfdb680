"""Explanation: a mission said back in sentences, diagrams of its windows, and the traps it touches.

in   Mission, as meant
out  words and values; nothing is solved, nothing is found wrong
"""
