"""SAT solvers in separate processes: Z3's finite-domain solver and CaDiCaL, and proofs of unsatisfiability."""
