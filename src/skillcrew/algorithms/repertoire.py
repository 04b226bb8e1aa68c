"""Which agents can choose, use and learn which of the skills, where agents differ."""

import dataclasses

from skillcrew.algorithms.skill_training import Members
from skillcrew.envs.environment import Environment
from skillcrew.errors import UserError


@dataclasses.dataclass(frozen=True)
class Repertoire:
    """The skills of each type of agents, as indices among those that are learned."""

    agents: tuple[int, ...]
    """How many each type has."""
    skills: tuple[tuple[int, ...], ...]
    """Of each type."""

    @classmethod
    def of(cls, env: Environment, names: tuple[str, ...]) -> "Repertoire | None":
        """In an environment, of the skills that are learned there; None where agents are alike.

        Raises:
            UserError: a type has none of them.
        """
        if not env.types:
            return None
        skills = []
        for kind in env.types:
            own = {f"{kind.name}/{skill}" for skill in kind.skills}
            skills.append(tuple(index for index, name in enumerate(names) if name in own))
            if not skills[-1]:
                given = ", ".join(sorted(own)) or "none yet, see AgentType.skills"
                raise UserError(
                    f"skills = {names}: agents of type {kind.name} have none of them to choose; add one "
                    f"({given})"
                )
        return cls(tuple(kind.agents for kind in env.types), tuple(skills))

    @property
    def choices(self) -> int:
        """Among how many an agent of the type with the most skills chooses."""
        return max(map(len, self.skills))

    @property
    def of_agents(self) -> tuple[tuple[int, ...], ...]:
        """For each agent the skill that each choice stands for; choices beyond its last begin anew."""
        return tuple(
            tuple(own[choice % len(own)] for choice in range(self.choices))
            for own, agents in zip(self.skills, self.agents, strict=True)
            for _ in range(agents)
        )

    @property
    def partners(self) -> tuple[tuple[int, ...], ...]:
        """For each skill the one that each agent uses while it is tried: others use one of their own."""
        return tuple(
            tuple(
                skill if skill in own else own[skill % len(own)]
                for own, agents in zip(self.skills, self.agents, strict=True)
                for _ in range(agents)
            )
            for skill in range(sum(map(len, self.skills)))
        )

    @property
    def members(self) -> Members:
        """Whose transitions each skill learns from."""
        of_skills = {
            skill: (sum(self.agents[:kind]), self.agents[kind])
            for kind, own in enumerate(self.skills)
            for skill in own
        }
        return Members(sum(self.agents), tuple(of_skills[skill] for skill in sorted(of_skills)))

    @property
    def users(self) -> tuple[tuple[bool, ...], ...]:
        """For each skill, which agents can use it."""
        return tuple(
            tuple(first <= agent < first + count for agent in range(sum(self.agents)))
            for first, count in self.members.of_skills
        )
