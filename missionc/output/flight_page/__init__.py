"""The page of a flight that goes on: what it knows, and its text; the map and the lanes are the report's."""
