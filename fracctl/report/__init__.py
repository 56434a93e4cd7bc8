"""Stored runs for reading: in words, as sentences and tables, and as one HTML file; reads the store only."""
