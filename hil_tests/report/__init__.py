"""What a play is worth: expectations held against what came of it, and reports for people and for CI."""
