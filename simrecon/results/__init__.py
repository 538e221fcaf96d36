"""The result folder: what is written into it, and what is read back."""

from __future__ import annotations

from simrecon.results.folder import check_writable, read, write

__all__ = ["check_writable", "read", "write"]
