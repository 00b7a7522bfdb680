"""The language server: what an editor asks of a mission while it is typed.

in   texts as they change, and requests about places in them
out  findings, and answers in the protocol's types

One module for each thing that an editor asks; ``server`` is the only one that
talks. Every other is a function of an ``OpenText``, and works on what can be read
of a text that is not whole.
"""
