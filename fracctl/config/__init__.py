"""Configurations: composed by Hydra, validated by schemas, turned into objects."""
