"""The SAT encoding: motion along time-expanded roadmaps and kernel formulas as flat clauses."""
