"""Static checks of a resolved mission: from IR to findings, without planning."""
