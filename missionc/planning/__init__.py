"""Search algorithms that backends and replanning share."""
