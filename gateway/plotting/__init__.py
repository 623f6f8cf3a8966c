"""Plots as values, drawn by plotly for a page and by matplotlib for a picture: the same figure in both."""
