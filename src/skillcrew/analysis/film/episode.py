"""An episode as a film shows it: what there is at any moment, also between two steps."""

import dataclasses
from collections.abc import Mapping
from typing import Any, NamedTuple

import jax
import numpy as np
from jaxtyping import Int

from skillcrew.analysis.page.colours import colours_of_choices
from skillcrew.analysis.page.scenery import checked_states, colours_of_scene
from skillcrew.analysis.skill_figures import readable_skill
from skillcrew.envs.offers import OffersScene, require
from skillcrew.envs.scene import Points, Scene
from skillcrew.experiment.episode_choice import chosen_episode, described
from skillcrew.experiment.recording import episodes_of
from skillcrew.experiment.run import Run


class Event(NamedTuple):
    """A thing changes its state."""

    step: int
    group: Points
    thing: int
    state: int


@dataclasses.dataclass(frozen=True)
class Episode:
    """One episode of n steps, with n + 1 moments."""

    title: str
    seed: int
    number: int
    """Of the episode, among those of its seed."""
    outcome: str
    solved: bool | None
    """None where the environment does not say what success is."""
    scene: Scene
    """In NumPy, leaves [moments, ...]."""
    choice: Int[np.ndarray, "steps agents"]
    skills: tuple[str, ...]
    """As people read them, in the order of the choice's index."""
    skill_colours: tuple[str, ...]
    colours: Mapping[str, str]
    """Of each kind of thing, and of each group without kinds."""

    @property
    def steps(self) -> int:
        """How many there are."""
        return len(self.choice)

    def at(self, moment: float | int) -> Scene:
        """What there is to see; between two steps things are on the straight line from one to the other."""
        before = int(moment)
        share, after = moment - before, min(before + 1, self.steps)

        def between(path: tuple[Any, ...], leaf: np.ndarray) -> np.ndarray:
            if share == 0 or path[-1].name == "state":
                return leaf[before]
            change = leaf[after] - leaf[before]
            if path[-1].name == "heading":
                change = (change + np.pi) % (2 * np.pi) - np.pi
            return leaf[before] + share * change

        # From somewhere to nowhere there is no way, and nothing is drawn on it.
        with np.errstate(invalid="ignore"):
            return jax.tree_util.tree_map_with_path(between, self.scene)

    def followed(self, moment: float | int) -> Int[np.ndarray, " agents"]:
        """The skill of each agent from a moment on; at the end, the one that it followed last."""
        return self.choice[min(int(moment), self.steps - 1)]

    def colour_of(self, group: Any, thing: int, otherwise: str) -> str:
        """The colour of one thing of a group."""
        kinds = getattr(group, "kinds", ())
        return self.colours.get(kinds[thing] if kinds else group.name, otherwise)

    def events(self) -> list[Event]:
        """What changes its state when, agents apart."""
        found = []
        for group in self.scene.points:
            if group.name != "agents" and group.states and group.state is not None:
                state = np.asarray(group.state)
                for step, thing in np.argwhere(np.diff(state, axis=0)).tolist():
                    found.append(Event(step + 1, group, thing, int(state[step + 1, thing])))
        return found


def episode_of(run: Run, seed: int | None = None, word: str | None = None) -> Episode:
    """Plays a champion's episodes, and takes one of them.

    Args:
        run: of a trained team.
        seed: of the champion; by default the run's first.
        word: which of its episodes; see `chosen_episode`.

    Raises:
        UserError: no such seed or episode, no champion, or nothing that can be drawn.
    """
    env, skills = run.algorithm.env, run.algorithm.choices()
    require(env, OffersScene, "a film")
    played = episodes_of(run, run.config.seeds[0] if seed is None else seed)
    index = chosen_episode(played, word)
    steps = int(played.steps[index])
    recording = played.recording.episodes(np.array([index]))
    scene = jax.tree.map(lambda leaf: leaf[0, : steps + 1], recording.scene)
    for part in ("points", "discs", "lines"):
        for place, group in enumerate(getattr(scene, part)):
            if group.state is not None:
                checked_states(f"{part}[{place}] ({group.name!r})", group)
    return Episode(
        title=f"{run.algorithm.label} on {env.name}",
        seed=played.seed,
        number=int(played.number[index]),
        outcome=described(played, index),
        solved=None if played.solved is None else bool(played.solved[index]),
        scene=scene,
        choice=np.asarray(recording.choice)[0, :steps],
        skills=tuple(map(readable_skill, skills)),
        skill_colours=tuple(colours_of_choices(skills)),
        colours=colours_of_scene(scene, skills),
    )
