"""What a check has to say."""

import dataclasses
from typing import Literal

Level = Literal["fine", "note", "wrong"]

MARKS = {"fine": "ok   ", "note": "note ", "wrong": "WRONG"}


@dataclasses.dataclass(frozen=True)
class Finding:
    """One thing that was looked at."""

    level: Level
    """"wrong" must be mended; of a "note" the author may know better."""
    about: str
    said: str
    """What is the case and, unless it is fine, how to mend it."""


@dataclasses.dataclass(frozen=True)
class CheckReport:
    """All that was looked at, in order."""

    name: str
    """Of the environment."""
    findings: tuple[Finding, ...]

    @property
    def ok(self) -> bool:
        """Whether nothing is wrong."""
        return all(finding.level != "wrong" for finding in self.findings)

    def __str__(self) -> str:
        width = max(len(finding.about) for finding in self.findings)
        lines = [f"{MARKS[one.level]} {one.about:<{width}}  {one.said}" for one in self.findings]
        end = (
            "Nothing is wrong."
            if self.ok
            else "Mend what is wrong and check again: what comes after it rests on it."
        )
        return "\n".join([self.name, *lines, end])
