"""Commands of ``missionc``, a module for each, with its ``command``."""
