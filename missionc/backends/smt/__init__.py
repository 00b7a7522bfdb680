"""Planning on roadmaps with a SAT solver behind Z3's or CaDiCaL's door. [strel]"""
