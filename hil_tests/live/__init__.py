"""A gateway that runs as its own process, and what plays a vehicle to it in real time: for `gateway bench live`."""
