"""The middle language: what every operator comes down to."""
