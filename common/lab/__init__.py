"""A laboratory as a process: its rig, its loop in time, its stream to the recorder, its checks before a start."""
