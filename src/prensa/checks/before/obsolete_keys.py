"""Keys of a description that are read and have no effect."""

from __future__ import annotations

from collections.abc import Iterator

from prensa.errors import Finding
from prensa.system.system import System


def obsolete_keys(system: System) -> Iterator[Finding]:
    """Old keys of enforcements that are read and do nothing."""
    for group in ("contacts", "body_contacts"):
        for k, contact in enumerate(getattr(system.problem, group)):
            for key in contact.enforcement.without_effect():
                yield Finding(f"{group}.{k}.enforcement.{key}", "has no effect any more; leave it out")
