"""Name resolution and typing: the tree as written to the mission as meant, in steps and SI units."""
