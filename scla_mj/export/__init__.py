"""A finished run's data in formats that others read, one file for each."""
