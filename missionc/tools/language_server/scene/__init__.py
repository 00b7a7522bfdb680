"""Map of a mission during editing, which the studio's page and an editor's preview draw.

in   a text and its readable declarations
out  plain values, with the spans in the text that dragging edits
"""
