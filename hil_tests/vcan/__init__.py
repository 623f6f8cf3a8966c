"""A small virtual machine with a real kernel, for a real `vcan0` where the machine's own kernel has no CAN.

It shares the host's root, read-only, so the project and its Python environment are there, at the same paths. It runs
by software emulation alone, 10 to 20 times slower than the host, and needs neither /dev/kvm nor root.
"""
