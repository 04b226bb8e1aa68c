"""Champions that leave the library, and come back."""
