"""The command line: flags in, files and text out, and an exit status."""
