"""The map of a mission while it is written: what the studio's page and an editor's preview draw.

in   a text, and the declarations of it that can be read
out  plain values, with the places in the text that a drag edits
"""
