"""Commands of ``missionc``: each module defines one as ``command``."""
