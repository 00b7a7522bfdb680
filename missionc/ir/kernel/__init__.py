"""The kernel: the core language to which every operator expands."""
