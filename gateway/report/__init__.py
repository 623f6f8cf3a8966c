"""The report of a dive: one HTML file, and the same figures as pictures."""
