"""The result folder: what is written into it, and what is read back."""

from __future__ import annotations

from simrecon.results.folder import check_writable
from simrecon.results.motion_file import read as read_motion
from simrecon.results.report_file import read as read_report
from simrecon.results.view import Result, open_result
from simrecon.results.writing import note, write

__all__ = ["Result", "check_writable", "note", "open_result", "read_motion", "read_report", "write"]
