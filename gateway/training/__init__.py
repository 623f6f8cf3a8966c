"""Training of the navigation watch's learnt predictor. Only here is PyTorch needed, the extra `train`."""
