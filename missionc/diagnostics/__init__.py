"""What the compiler says: codes, values, renderers, explanations."""
