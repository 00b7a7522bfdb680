"""Search algorithms shared by backends and replanning."""
