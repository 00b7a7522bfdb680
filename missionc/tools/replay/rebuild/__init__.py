"""Check of a folder's documents: each is computed from verified data, and compared with the one in the folder."""
