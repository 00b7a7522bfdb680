"""Planning of smooth joint motions by transport and polish. [clot]"""

from missionc.backends.clot.plan import BACKEND

__all__ = ["BACKEND"]
