"""The Rerun recording of a run, and reading it back.

`recording.RerunRecorder` writes, by the views in `views/`; `reading/` reads. Only this package imports rerun (which
takes 0.6 s), and nothing here can touch a run.
"""
