"""Runtime monitoring: truth and robustness of kernel formulas along a trace."""
