"""The Rerun recording of a run, and reading it back.

`recording.RerunRecorder` writes, `reader.inspect_recording` reads a file alone, `agreement.compare` sets it beside
the run's other files. Only this package imports rerun (which takes 0.6 s), and nothing here can touch a run.
"""
