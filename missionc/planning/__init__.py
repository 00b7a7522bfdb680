"""Search that backends and replanning share."""
