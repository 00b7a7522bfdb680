"""Explanation: a mission restated in sentences, diagrams of its windows, and the traps it touches.

in   Mission, as meant
out  words and values; without solving or checking
"""
