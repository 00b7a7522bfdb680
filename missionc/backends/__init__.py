"""Planning backends: a mission and its kernel formula to a trace, by SAT, by trajectory optimisation, or by both."""
