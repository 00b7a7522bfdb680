"""Export of verified flights to formats that other programs fly, show or replay, with a module for each format."""
