"""Replay of an output folder from its files alone: verified, flown in simulation and drawn again."""
