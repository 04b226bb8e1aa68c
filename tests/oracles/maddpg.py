"""MADDPG and MATD3 in NumPy, row by row and agent by agent, with gradients by hand.

Lowe et al. 2017, equations 5 and 6 and section 4.3; Ackermann et al. 2019; Jang et al. 2017 for discrete
actions.
"""

import dataclasses

import numpy as np

from oracles.td3 import Adam, Net


@dataclasses.dataclass
class Steps:
    """[batch, agents, …] each, but for whether the task was done: [batch, agents], the same for all."""

    observation: np.ndarray
    action: np.ndarray
    reward: np.ndarray
    next_observation: np.ndarray
    terminated: np.ndarray
    acted: np.ndarray


class Crew:
    """Actors by agent and policy, critics by twin and agent; one alone is everybody's."""

    def __init__(self, actors: list[list[Net]], critics: list[list[Net]], config, discrete: bool):
        self.actors, self.critics, self.config, self.discrete = actors, critics, config, discrete
        self.target_actors = [[net.copy() for net in policies] for policies in actors]
        self.target_critics = [[net.copy() for net in twin] for twin in critics]
        self.actor_adams = [[Adam(net, config.actor_learning_rate) for net in own] for own in actors]
        self.critic_adams = [[Adam(net, config.critic_learning_rate) for net in own] for own in critics]

    def outputs(self, actors: list[list[Net]], seen: np.ndarray, acted: np.ndarray) -> np.ndarray:
        """What each agent's acting policy says in each row."""
        rows = [
            [
                actors[agent % len(actors)][acted[row, agent]].forward(seen[row, agent][None])[0][0]
                for agent in range(seen.shape[1])
            ]
            for row in range(len(seen))
        ]
        return np.array(rows)

    def values(self, twin: list[Net], seen: np.ndarray, action: np.ndarray) -> np.ndarray:
        """[batch, agents]: Q_i(x, a_1 … a_N)."""
        inputs = np.concatenate([seen.reshape(len(seen), -1), action.reshape(len(seen), -1)], axis=1)
        told = [critic.forward(inputs)[0] for critic in twin]
        return told[0] if len(twin) == 1 else np.concatenate(told, axis=1)

    def targets(self, steps: Steps, normal: np.ndarray, gumbel: np.ndarray) -> np.ndarray:
        """y_i; the draws are those behind ε and behind discrete actions."""
        config = self.config
        outputs = self.outputs(self.target_actors, steps.next_observation, steps.acted)
        if self.discrete:
            action = np.eye(outputs.shape[-1])[(outputs + gumbel).argmax(-1)]
        else:
            noise = np.clip(config.target_noise * normal, -config.target_noise_clip, config.target_noise_clip)
            action = np.clip(np.tanh(outputs) + noise, -1, 1)
        values = [self.values(twin, steps.next_observation, action) for twin in self.target_critics]
        return steps.reward + config.discount * (1 - steps.terminated) * np.min(values, axis=0)

    def update_critics(self, steps: Steps, normal: np.ndarray, gumbel: np.ndarray) -> float:
        """Mean square error of each agent's value; returns their mean."""
        target, size = self.targets(steps, normal, gumbel), len(steps.reward)
        inputs = np.concatenate([steps.observation.reshape(size, -1), steps.action.reshape(size, -1)], axis=1)
        losses = []
        for twin, adams in zip(self.critics, self.critic_adams, strict=True):
            for whose, (critic, adam) in enumerate(zip(twin, adams, strict=True)):
                told, layers = critic.forward(inputs)
                error = told - (target if len(twin) == 1 else target[:, whose : whose + 1])
                losses.append(np.mean(error**2, axis=0))
                adam.descend(critic, critic.backward(layers, 2 * error / size)[0])
        return float(np.mean(np.concatenate(losses)))

    def update_actors_and_targets(self, steps: Steps, gumbel: np.ndarray) -> float:
        """Each actor climbs the first twin's value of its own action among those that others took."""
        n_agents, penalty = steps.reward.shape[1], self.config.saturation_penalty
        outputs = self.outputs(self.actors, steps.observation, steps.acted)
        own, slopes_through = self._acted(outputs, gumbel)
        gradients = [[_nothing_like(net) for net in policies] for policies in self.actors]
        losses = []
        for agent in range(n_agents):
            action = steps.action.copy()
            action[:, agent] = own[:, agent]
            size = len(action)
            inputs = np.concatenate([steps.observation.reshape(size, -1), action.reshape(size, -1)], axis=1)
            twin = self.critics[0]
            critic, value = (twin[0], agent) if len(twin) == 1 else (twin[agent], 0)
            told, layers = critic.forward(inputs)
            slope = np.zeros_like(told)
            slope[:, value] = -1 / size
            by_inputs = critic.backward(layers, slope)[1]
            by_action = by_inputs[:, -action[0].size :].reshape(action.shape)[:, agent]
            unbounded = outputs[:, agent]
            by_output = slopes_through(agent, by_action) + 2 * penalty * unbounded / unbounded.size
            losses.append(penalty * np.mean(unbounded**2) - told[:, value].mean())
            place = agent % len(self.actors)
            for policy, net in enumerate(self.actors[place]):
                rows = steps.acted[:, agent] == policy
                _, layers = net.forward(steps.observation[rows, agent])
                _add(gradients[place][policy], net.backward(layers, by_output[rows])[0])
        for nets, adams, found in zip(self.actors, self.actor_adams, gradients, strict=True):
            for net, adam, gradient in zip(nets, adams, found, strict=True):
                adam.descend(net, gradient)
        self._follow()
        return float(np.mean(losses))

    def _acted(self, outputs: np.ndarray, gumbel: np.ndarray):
        """Actions, and how a slope at an agent's action goes on to its outputs."""
        if not self.discrete:
            action = np.tanh(outputs)
            return action, lambda agent, slope: slope * (1 - action[:, agent] ** 2)
        disturbed = (outputs + gumbel) / self.config.temperature
        soft = np.exp(disturbed - disturbed.max(-1, keepdims=True))
        soft /= soft.sum(-1, keepdims=True)
        hard = np.eye(outputs.shape[-1])[disturbed.argmax(-1)]

        def slopes(agent: int, slope: np.ndarray) -> np.ndarray:
            p = soft[:, agent]
            return p * (slope - (p * slope).sum(-1, keepdims=True)) / self.config.temperature

        return hard, slopes

    def _follow(self) -> None:
        pairs = [(self.target_actors, self.actors), (self.target_critics, self.critics)]
        for targets, networks in pairs:
            for some, others in zip(targets, networks, strict=True):
                for target, network in zip(some, others, strict=True):
                    target.follow(network, self.config.soft_update)


def _nothing_like(net: Net) -> Net:
    return Net([w * 0 for w in net.weights], [b * 0 for b in net.biases])


def _add(net: Net, other: Net) -> None:
    for mine, theirs in zip(net.weights + net.biases, other.weights + other.biases, strict=True):
        mine += theirs
