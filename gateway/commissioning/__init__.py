"""Learns from healthy recordings what the configuration needs, and says how sure it is."""
