"""Extensions of missionc for carts."""

INTERFACE = 1
