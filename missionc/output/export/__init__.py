"""Export of verified flights in the formats that other programs fly, show or replay: one module for each."""
