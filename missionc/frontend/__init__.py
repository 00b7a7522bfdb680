"""Front end: from mission text to the resolved mission (IR), and findings about it."""
