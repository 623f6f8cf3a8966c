"""Logs of real dives as a source of frames and packets, that can be played again and changed on the way."""
