"""A scenario: one readable YAML file that says what a vehicle does, what goes wrong, and what is to be said of it."""
