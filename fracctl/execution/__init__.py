"""Running: blocks of a survey on one process or many, their rows into the store, and all that follows."""
