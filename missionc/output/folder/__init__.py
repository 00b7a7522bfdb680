"""Atomic writing of files and folders: staged next to their target, all or nothing, and only over the compiler's own
files.
"""
