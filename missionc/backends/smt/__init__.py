"""SAT-based planning on roadmaps: flat clauses for Z3's finite-domain solver or CaDiCaL.

Prioritized planning first.
"""
