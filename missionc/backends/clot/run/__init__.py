"""A run of the transport backend: its settings, its state between attempts, and attempts in child processes."""
