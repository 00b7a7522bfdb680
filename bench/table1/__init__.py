"""The methods that ``clot_table1.py`` holds against each other, one a file, and how they are run and scored.

Every method is a function from a mission, its kernel and a seed to a ``Trace``, or to words that
say why there is none. All numbers of the mission come from its IR.
"""
