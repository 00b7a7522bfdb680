"""A farm that goes on looking: random trials of the compiler, each in a process of its own, and what they find.

in   a seed, how long to look, a journal of what was looked at before
out  a line of the journal for each trial; a file for each finding, as small as it could be made

From top to bottom: ``__main__`` reads the command line; ``look`` takes one trial after the other; ``trials`` says what
the trial of a number is; ``own_process`` carries it out; ``shrink`` makes a finding smaller and ``found_files`` keeps
it; ``journal`` and ``table`` say what was done. ``kinds/`` has a module for each kind of trial, ``referees/`` what
judges answers.
"""
