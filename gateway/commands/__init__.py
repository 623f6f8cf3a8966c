"""The commands of `gateway` that have a module of their own."""
