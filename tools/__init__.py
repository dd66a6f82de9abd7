"""What maintainers run from a checkout: `make help` lists the targets."""
