"""Values and services that every stage uses: text and its places, units, limits, signals, traces."""
