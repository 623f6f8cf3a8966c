"""The parts of the supervisor (`gateway.supervisor`), each pure: time comes in, decisions go out."""
