"""Values and services for every stage: text and spans, units, limits, signals, traces."""
