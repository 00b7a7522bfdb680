"""Maps: files of other programs to shapes and points in metres. Each format has a module of its own."""
