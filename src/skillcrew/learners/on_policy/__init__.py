"""What learners on fresh episodes share: returns, minibatches, networks over time."""
