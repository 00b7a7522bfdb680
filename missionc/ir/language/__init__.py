"""The language's vocabulary: operators, a file for each family, and predicates."""
