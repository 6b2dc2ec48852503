"""JPEG pictures that can be trusted: every code is read before a decoder may conceal anything."""
