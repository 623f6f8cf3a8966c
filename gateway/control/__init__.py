"""The control socket: `gateway tell` on one end, the running gateway on the other."""
