"""What is left of a mission after its first steps: formulas progressed through what was flown, and the world since."""
