"""Extensions of missionc for carts: a predicate, dynamics, a backend, and an export."""

INTERFACE = 1
