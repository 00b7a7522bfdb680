"""Atomic writing of files and folders: staged beside what they replace, whole or not at all, only over what is ours."""
