"""Command line: parses flags, calls the tools, and writes results as files, text and an exit status."""
