"""Cost graph: the kernel with unrolled routes, and the exact robustness of its formulas for an optimiser."""
