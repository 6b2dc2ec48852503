"""The live page: what a run sees, in a browser, over one small server of our own."""
