"""Commands of ``missionc``, one module each, with its ``command``."""
