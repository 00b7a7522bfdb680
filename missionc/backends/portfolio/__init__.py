"""Portfolio: several backends take turns until one of them finds a plan."""
