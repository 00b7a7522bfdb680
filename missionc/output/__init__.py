"""Output: the files of a verified plan, and functions that write them."""
