"""What the language has: operators and predicates, each one file."""
