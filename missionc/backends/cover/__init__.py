"""The cover: an over-approximation of a mission, whose refusal proves that no motion satisfies it."""
