"""Functions of plan folders, from their files alone: verification, simulation and redrawing."""
