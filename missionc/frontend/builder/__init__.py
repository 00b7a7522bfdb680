"""Missions built in Python: parts with operators, the mission of them, and the lines that findings point at."""
