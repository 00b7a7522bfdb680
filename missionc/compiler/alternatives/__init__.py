"""Alternative plans: ranked plans of one mission with different disjuncts, orders of events or homotopy classes."""
