"""The command line: flags in, files and words out, an exit status at the end."""
