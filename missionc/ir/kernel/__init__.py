"""The kernel: the core language that every operator comes down to."""
