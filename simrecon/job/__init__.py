"""What a user asks for: the whole of it in one frozen `Job`, read from and written to `job.toml`."""

from __future__ import annotations

from simrecon.job.checking import checked
from simrecon.job.files import absolute, dumps, identity, read
from simrecon.job.options import Person, Reading
from simrecon.job.request import Job

__all__ = ["Job", "Person", "Reading", "absolute", "checked", "dumps", "identity", "read"]
