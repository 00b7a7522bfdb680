"""The cost graph: kernel formulas in negation normal form, as terms with exact robustness for an optimiser."""
