"""A GigE Vision camera on the loopback interface: bytes of GVCP and GVSP, and its faults."""
