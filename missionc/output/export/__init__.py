"""Export of verified flights in the forms that other programs fly, show or replay: one module for each."""
