"""The run folder: what a run leaves on disk, written as it goes and checked when it is read."""
