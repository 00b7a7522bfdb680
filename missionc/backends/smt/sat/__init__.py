"""SAT solvers in processes of their own: Z3's finite-domain solver and CaDiCaL, and proofs of unsatisfiability."""
