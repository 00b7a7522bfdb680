"""Functions of the public API with the terms of the command line: values in, values out, no output."""
