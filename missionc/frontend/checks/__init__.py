"""Static checks of a mission as meant: IR to findings, without planning."""
