"""skillcrew: team coordination under sparse rewards, by evolution, learned skills and credit assignment."""

import lazy_loader

# Only what is used is imported: JAX alone takes a second, which `skillcrew list` need not wait for.
__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
