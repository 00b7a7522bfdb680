"""Methods compared by ``clot_table1.py``, one file each, with their runner and score.

Every method is a function from a mission, its kernel and a seed to a ``Trace``, or to a text with the reason why there
is none. All numbers of the mission come from its IR.
"""
