"""Sweeps: any settings and seeds, run on Dask, gathered into a table and a figure (docs/sweeps.md)."""
