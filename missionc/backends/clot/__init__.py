"""Planning of smooth joint motions by transport and polish. [clot]

Nothing is imported here: the cost graph is shown without torch, which planning needs.
"""
