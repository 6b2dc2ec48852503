"""Our depth beside the usual stereo matchers, on the same frames and through the same curve."""
