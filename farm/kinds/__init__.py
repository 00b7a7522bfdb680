"""The kinds of trials, a module each: what one draws, what it does with that, and what may not come of it."""
