"""What judges the answers of commands: a second reading of the semantics, and promises that several answers keep."""
