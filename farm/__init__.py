"""A test farm: random trials of the compiler, each in a process of its own, and their findings.

in   a seed, a duration, a journal of earlier trials
out  a line of the journal for each trial; a minimized file for each finding

From top to bottom: ``__main__`` reads the command line; ``look`` takes one trial after the other; ``trials`` defines
the trial of a number; ``own_process`` carries it out; ``shrink`` makes a finding smaller and ``found_files`` keeps it;
``journal`` and ``table`` record the trials. ``kinds/`` has a module for each kind of trial, ``referees/`` checks the
answers.
"""
