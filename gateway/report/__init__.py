"""The report of a dive: one HTML file, and the same figures as pictures."""

# in the folder that a replay writes to: the file, and the folder of the pictures
PAGE, PICTURES = "report.html", "plots"
