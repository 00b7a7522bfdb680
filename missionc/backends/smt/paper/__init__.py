"""Published method of [strel], as a preset: its roadmaps, its encoding, one question to Z3."""
