"""The language's vocabulary: operators and predicates, each one file."""
