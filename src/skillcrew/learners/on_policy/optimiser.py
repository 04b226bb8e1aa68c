"""Adam, as policy gradients are usually followed."""

import optax


def clipped_adam(learning_rate: float, longest: float) -> optax.GradientTransformation:
    """On gradients of bounded length: one longer than `longest` is cut to that length."""
    return optax.chain(optax.clip_by_global_norm(longest), optax.adam(learning_rate, eps=1e-5))


def differentiable_adam(learning_rate: float) -> optax.GradientTransformation:
    """Adam, whose step has a derivative by the gradient also where the gradient has always been 0."""
    return optax.adam(learning_rate, eps=1e-5, eps_root=1e-12)
