"""Messages of fixed layout: their signals as values, and as the readings of thrusters."""
