"""The cover: an over-approximation of a mission, whose refusal is a proof that no motion satisfies it."""
