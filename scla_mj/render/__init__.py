"""A stored run in MuJoCo again: videos, pictures, a window (docs/viewing.md). From the recording: no physics runs."""
