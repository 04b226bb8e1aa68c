"""TD3 in NumPy, with gradients by hand: thesis, equations 3.1 to 3.4; Fujimoto et al. 2018.

Adam is Algorithm 1 of Kingma and Ba 2015.
"""

import dataclasses

import numpy as np

Arrays = list[np.ndarray]


@dataclasses.dataclass
class Net:
    """Rectified linear layers and a linear last one."""

    weights: Arrays
    biases: Arrays

    def copy(self) -> "Net":
        return Net([w.copy() for w in self.weights], [b.copy() for b in self.biases])

    def forward(self, x: np.ndarray) -> tuple[np.ndarray, Arrays]:
        """Outputs, and the input of each layer."""
        inputs = []
        for layer, (weight, bias) in enumerate(zip(self.weights, self.biases, strict=True)):
            inputs.append(x)
            x = x @ weight + bias
            if layer < len(self.weights) - 1:
                x = np.maximum(x, 0)
        return x, inputs

    def backward(self, inputs: Arrays, slope: np.ndarray) -> tuple["Net", np.ndarray]:
        """Gradients of the parameters and of the input, from the slope of the loss at the output."""
        weights, biases = [], []
        for layer in reversed(range(len(self.weights))):
            weights.insert(0, inputs[layer].T @ slope)
            biases.insert(0, slope.sum(0))
            slope = slope @ self.weights[layer].T
            if layer:
                slope = slope * (inputs[layer] > 0)
        return Net(weights, biases), slope

    def follow(self, other: "Net", share: float) -> None:
        """Equation 3.4."""
        for mine, theirs in zip(self.weights + self.biases, other.weights + other.biases, strict=True):
            mine[...] = share * theirs + (1 - share) * mine


class Adam:
    """Step size, two moments with decays 0.9 and 0.999, both corrected for their start at 0."""

    def __init__(self, net: Net, step_size: float):
        self.step_size, self.time = step_size, 0
        self.first = [np.zeros_like(p) for p in net.weights + net.biases]
        self.second = [np.zeros_like(p) for p in net.weights + net.biases]

    def descend(self, net: Net, gradient: Net) -> None:
        self.time += 1
        slopes = gradient.weights + gradient.biases
        for p, m, v, g in zip(net.weights + net.biases, self.first, self.second, slopes, strict=True):
            m[...] = 0.9 * m + 0.1 * g
            v[...] = 0.999 * v + 0.001 * g**2
            m_hat, v_hat = m / (1 - 0.9**self.time), v / (1 - 0.999**self.time)
            p -= self.step_size * m_hat / (np.sqrt(v_hat) + 1e-8)


@dataclasses.dataclass
class Transitions:
    observation: np.ndarray
    action: np.ndarray
    reward: np.ndarray
    next_observation: np.ndarray
    terminated: np.ndarray


class Learner:
    """An actor, its critics and their targets. Critics see the scaled observation and the action."""

    def __init__(self, actor: Net, critics: list[Net], config, square_root: bool):
        self.actor, self.critics, self.config = actor, critics, config
        self.target_actor, self.target_critics = actor.copy(), [critic.copy() for critic in critics]
        self.actor_adam = Adam(actor, config.actor_learning_rate)
        self.critic_adams = [Adam(critic, config.critic_learning_rate) for critic in critics]
        self.square_root = square_root

    def see(self, observation: np.ndarray) -> np.ndarray:
        return 2 * np.sign(observation) * np.sqrt(np.abs(observation)) if self.square_root else observation

    def value(self, critic: Net, observation: np.ndarray, action: np.ndarray) -> tuple[np.ndarray, Arrays]:
        output, inputs = critic.forward(np.concatenate([self.see(observation), action], axis=1))
        return output[:, 0], inputs

    def update_critics(self, batch: Transitions, normal: np.ndarray) -> float:
        """Equations 3.1 and 3.2; `normal` is the standard normal draw behind ε."""
        config = self.config
        noise = np.clip(config.target_noise * normal, -config.target_noise_clip, config.target_noise_clip)
        aimed = np.tanh(self.target_actor.forward(self.see(batch.next_observation))[0])
        action = np.clip(aimed + noise, -1, 1)
        values = [self.value(critic, batch.next_observation, action)[0] for critic in self.target_critics]
        target = batch.reward + config.discount * (1 - batch.terminated) * np.min(values, axis=0)
        losses = []
        for critic, adam in zip(self.critics, self.critic_adams, strict=True):
            value, inputs = self.value(critic, batch.observation, batch.action)
            losses.append(np.mean((target - value) ** 2))
            slope = 2 * (value - target)[:, None] / len(target)
            adam.descend(critic, critic.backward(inputs, slope)[0])
        return float(np.mean(losses))

    def update_actor_and_targets(self, batch: Transitions) -> float:
        """Equations 3.3 and 3.4, with the penalty on outputs before tanh where there is one."""
        penalty = self.config.saturation_penalty
        unbounded, actor_inputs = self.actor.forward(self.see(batch.observation))
        action = np.tanh(unbounded)
        value, critic_inputs = self.value(self.critics[0], batch.observation, action)
        loss = penalty * np.mean(unbounded**2) - np.mean(value)
        slope = np.full((len(value), 1), -1 / len(value))
        by_action = self.critics[0].backward(critic_inputs, slope)[1][:, -action.shape[1] :]
        by_unbounded = by_action * (1 - action**2) + 2 * penalty * unbounded / unbounded.size
        self.actor_adam.descend(self.actor, self.actor.backward(actor_inputs, by_unbounded)[0])
        self.target_actor.follow(self.actor, self.config.soft_update)
        for target, critic in zip(self.target_critics, self.critics, strict=True):
            target.follow(critic, self.config.soft_update)
        return float(loss)
