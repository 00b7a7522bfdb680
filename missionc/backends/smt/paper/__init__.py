"""Published method of [strel], as a preset: its roadmaps, its encoding, one query to Z3."""
