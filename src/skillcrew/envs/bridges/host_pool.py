"""Worlds that live on the host, found again by what happened in them.

JAX holds the whole story of each world, its seed and its actions, so that stepping is a pure function of that
story; the worlds here only spare telling it again, and one that is not here is replayed from its seed.
"""

import hashlib
import threading
from collections import OrderedDict

import numpy as np
from jaxtyping import Bool, Float, Int32, Shaped, UInt32

from skillcrew.envs.bridges.host_world import HostWorld, MakeWorld, Moved

FEWEST = 64
"""Worlds that may be kept alive in any case."""
BATCHES = 2
"""Batches of worlds that may be kept alive, of the largest size that came in one call: training and scoring,
which JAX may step in turns."""

Story = tuple[int, int, bytes]
"""Seed, steps since, and a digest of the actions."""


class Pool:
    """Steps many worlds in one call, each of them for itself. Threads may share it.

    Args:
        make: makes one more world.
        first: one that is made already.
    """

    def __init__(self, make: MakeWorld, first: HostWorld):
        self._make = make
        self._spare = [first]
        self._made, self._limit = 1, FEWEST
        # Several worlds may have the same story: teams that have acted alike so far.
        self._alive: OrderedDict[Story, list[HostWorld]] = OrderedDict()
        self._lock = threading.Lock()

    def reset(self, seeds: UInt32[np.ndarray, "*worlds"]) -> Float[np.ndarray, "*worlds numbers"]:
        """What all agents of each world see at its start, in a row."""
        with self._lock:
            self._limit = max(self._limit, BATCHES * seeds.size)
            seen = []
            for seed in seeds.flat:
                world = self._any_world()
                seen.append(world.reset(int(seed)))
                self._keep((int(seed), 0, bytes(8)), world)
        return np.stack(seen).reshape(*seeds.shape, -1)

    def step(
        self,
        seed: UInt32[np.ndarray, "*worlds"],
        time: Int32[np.ndarray, "*worlds"],
        digest: UInt32[np.ndarray, "*worlds 2"],
        past: Shaped[np.ndarray, "*worlds length numbers"],
        over: Bool[np.ndarray, "*worlds"],
        action: Shaped[np.ndarray, "*worlds numbers"],
    ) -> tuple[list[Moved | None], UInt32[np.ndarray, "*worlds 2"]]:
        """Moves all worlds that are not over.

        Args:
            past: the actions so far, of which the first `time` count.

        Returns:
            What happened in each world, in C order, None where it was over; and the digests of the longer
            stories.
        """
        count = over.size
        digests, pasts = digest.reshape(count, 2), past.reshape(count, *past.shape[-2:])
        actions, seeds, times = action.reshape(count, -1), seed.reshape(-1), time.reshape(-1)
        moved: list[Moved | None] = [None] * count
        longer = digests.copy()
        stories = {
            int(index): (int(seeds[index]), int(times[index]), digests[index].tobytes())
            for index in np.flatnonzero(~over)
        }
        with self._lock:
            self._limit = max(self._limit, BATCHES * count)
            # All that is alive is claimed before any world is taken to replay another.
            alive = {index: self._claim(story) for index, story in stories.items()}
            try:
                for index, story in stories.items():
                    action_now = actions[index]
                    told = hashlib.blake2b(story[2] + action_now.tobytes(), digest_size=8).digest()
                    longer[index] = np.frombuffer(told, np.uint32)
                    world = alive[index] or self._replayed(story, pasts[index])
                    moved[index] = now = world.step(action_now)
                    if now.terminated or now.truncated:
                        self._spare.append(world)
                    else:
                        self._keep((story[0], story[1] + 1, told), world)
            except BaseException:
                # Who was claimed and where it stands is not known any more.
                self._alive.clear()
                self._spare.clear()
                self._made = 0
                raise
        return moved, longer.reshape(digest.shape)

    def _claim(self, story: Story) -> HostWorld | None:
        alike = self._alive.get(story)
        if alike is None:
            return None
        world = alike.pop()
        if not alike:
            del self._alive[story]
        return world

    def _keep(self, story: Story, world: HostWorld) -> None:
        self._alive.setdefault(story, []).append(world)
        self._alive.move_to_end(story)

    def _replayed(self, story: Story, past: Shaped[np.ndarray, "length numbers"]) -> HostWorld:
        seed, steps, _ = story
        world = self._any_world()
        world.reset(seed)
        for action in past[:steps]:
            world.step(action)
        return world

    def _any_world(self) -> HostWorld:
        """One that nobody waits for, a new one, or the one that was left alone for longest."""
        if self._spare:
            return self._spare.pop()
        if self._made < self._limit:
            self._made += 1
            return self._make()
        oldest = next(iter(self._alive))
        world = self._claim(oldest)
        assert world is not None
        return world
