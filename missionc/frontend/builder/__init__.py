"""Missions built in Python: parts with operators, missions composed of parts, and the lines that findings refer to."""
