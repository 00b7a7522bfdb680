"""Language server: answers an editor's requests about the mission that is being edited.

in   texts as they change, and requests about positions in them
out  findings, and answers in the protocol's types

One module for each kind of request; only ``server`` communicates. All others are functions of an ``OpenText``, and work
on the readable parts of an incomplete text.
"""
