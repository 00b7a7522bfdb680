"""The command line: flags in, files and words out."""
