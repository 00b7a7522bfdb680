"""Output: the files of a verified plan, and the writing of them."""
