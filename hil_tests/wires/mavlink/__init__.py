"""What sensors' faults do to MAVLink: packets cut out of a stream, signals in their payloads, packets sealed anew."""
