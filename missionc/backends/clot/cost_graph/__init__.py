"""The cost graph: the kernel with its routes unrolled, and the exact robustness of its formulas for an optimiser."""
