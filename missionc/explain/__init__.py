"""What a mission says, said back: sentences, diagrams of its windows, and the traps it touches.

in   Mission, as meant
out  words and values; nothing is solved, nothing is found wrong
"""
