"""Writing of files and folders: staged beside what they replace, whole or not at all, and only over what is ours."""
