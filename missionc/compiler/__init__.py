"""Pipeline from mission text to a verified plan with its files, or to the reason why there is no plan."""
