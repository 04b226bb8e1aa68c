"""Tells in words what is wrong with an environment, and what is fine."""

import jax

from skillcrew.envs.checks.interface import check_attributes, check_shapes
from skillcrew.envs.checks.kinds import check_kinds
from skillcrew.envs.checks.offered import check_offers
from skillcrew.envs.checks.play import check_episodes, check_worlds
from skillcrew.envs.checks.purity import check_keys, check_purity
from skillcrew.envs.checks.report import CheckReport, Finding
from skillcrew.envs.checks.subject import Subject
from skillcrew.envs.environment import Environment

CHECKS = (
    check_attributes,
    check_kinds,
    check_shapes,
    check_offers,
    check_purity,
    check_keys,
    check_episodes,
    check_worlds,
)
"""In this order: each rests on those before it."""


def check_environment(env: Environment, seed: int = 0) -> CheckReport:
    """Looks an environment over by playing in it.

    Args:
        seed: of the episodes of random actions.

    Returns:
        What is fine, what may be meant otherwise, and what is wrong, each with how to mend it. Where a check
        finds something wrong, those after it, which rest on it, are left out.
    """
    subject = Subject(env, jax.random.key(seed))
    findings: list[Finding] = []
    for check in CHECKS:
        findings += check(subject)
        if any(finding.level == "wrong" for finding in findings):
            findings = [
                finding for finding in findings if finding.level != "fine" or finding.about == "sizes"
            ]
            break
    return CheckReport(str(env.name), tuple(findings))
