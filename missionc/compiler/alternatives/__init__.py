"""Alternative plans: ranked plans of one mission that differ in an option, an order or a side."""
