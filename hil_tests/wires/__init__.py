"""What becomes of frames and packets on their way: nothing, unless a fault says so. Pure: the time is passed in."""
