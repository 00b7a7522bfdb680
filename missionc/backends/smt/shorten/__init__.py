"""Local search for a better plan: shorter paths, less distance, less time, with every goal satisfied."""
