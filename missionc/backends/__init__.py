"""Planning backends: from a mission and its kernel formula to a trace, by SAT, trajectory optimisation, or both."""
