"""Output: what comes of a plan as files, and the writing of them."""
