"""Maps: files of other programs to shapes and points in metres. Each form has a module of its own."""
