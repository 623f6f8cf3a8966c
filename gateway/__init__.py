"""The program: readings are aligned into samples, judged by the detectors, and told to pilot and autopilot."""
