"""Thruster fault detection after paper 000 (Xu et al. 2021, Applied Sciences 11, 3586), and beyond it."""
