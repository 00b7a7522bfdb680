"""Local search from a plan to a better one: shorter paths, less distance, less time, with every goal kept."""
