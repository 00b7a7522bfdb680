"""The method of [strel] as published, as a preset: its roadmaps, its encoding, Z3 asked once."""
