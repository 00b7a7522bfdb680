"""Text to the mission as meant, and findings about it."""
