"""The map of a mission during editing: drawn by the studio's page and by an editor's preview.

in   a text and its readable declarations
out  plain values, with the places in the text that dragging edits
"""
