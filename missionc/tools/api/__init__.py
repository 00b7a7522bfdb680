"""Functions of the public API, with the words of the command line: values in, values out, nothing printed."""
