"""Export of verified flights to formats that other programs fly, show or replay: one module for each."""
