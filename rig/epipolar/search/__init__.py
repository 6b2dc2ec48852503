"""Where each pixel's slope roughly is: plane sweeps, aggregation, and how they are judged."""
