"""One module for each command that has nothing to do with planning; each holds a ``command``."""
