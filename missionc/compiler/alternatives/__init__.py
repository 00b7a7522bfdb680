"""Alternative plans: further ones of the same mission that differ in an option, an order or a side, ranked."""
