"""Pictures and text pictures of what is in the room, from cells as the observation has them."""
