"""Keys of MAVLink 2 signing: read from their file, kept monotonic over restarts, and put to use on the link."""
