"""Planning of missions that need both: Z3 on roadmaps for what is counted, transport for what is measured."""
