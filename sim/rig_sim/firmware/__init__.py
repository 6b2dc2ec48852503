"""The other end of the wire: simulated stage firmware, so that the real drivers run in tests."""
