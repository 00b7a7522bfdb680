"""SAT encoding: motion along time-expanded roadmaps, and kernel formulas, as clauses."""
