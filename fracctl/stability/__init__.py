"""Verdicts on stability."""

from fracctl.stability.assess import Verdict, assess

__all__ = ["Verdict", "assess"]
