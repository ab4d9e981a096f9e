"""The rules of the game: what an ant perceives, may do and is paid for."""
