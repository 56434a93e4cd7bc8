"""The YAML files of this package."""
