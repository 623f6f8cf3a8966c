"""How a running gateway is, for Prometheus: a telemetry as metrics, and the port of the loopback that serves them."""
