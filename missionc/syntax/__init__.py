"""From text to a tree, as written: nothing is looked up here."""
