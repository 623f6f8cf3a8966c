"""In the middle of real hardware: frames and packets pass both ways, and scripted faults change them in flight."""
