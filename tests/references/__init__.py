"""Reference solutions that share nothing with fracctl: explicit matrices in, many digits or closed forms out."""

from __future__ import annotations
