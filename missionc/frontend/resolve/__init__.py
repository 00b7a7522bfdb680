"""Name resolution and typing: from the syntax tree to the resolved mission (IR), in steps and SI units."""
