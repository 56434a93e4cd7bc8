"""Fractional operators and the linear fractional equation as data."""
