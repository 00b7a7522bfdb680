"""SAT-based planning on roadmaps: prioritized planning first, then clauses for Z3's finite-domain solver or CaDiCaL."""
