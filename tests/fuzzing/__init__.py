"""What is thrown at the loader, what must hold then, and mistakes to be planted in it."""
