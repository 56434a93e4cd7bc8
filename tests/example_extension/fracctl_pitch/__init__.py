"""Pitch of a satellite under the gravity gradient, for fracctl."""
