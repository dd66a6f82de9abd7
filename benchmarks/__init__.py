"""The comparisons of `make bench`; they stay in the repository, no wheel carries them."""
