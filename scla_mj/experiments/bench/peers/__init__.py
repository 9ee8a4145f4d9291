"""The same network in other simulators. These files run in an environment of their own and import nothing of scla_mj.

Brian2 wants an older numpy than this package's lock holds. README's line makes the environment from `requirements.txt`;
`worker.py` is started by that environment's interpreter and talks to the bench over a pipe.
"""
