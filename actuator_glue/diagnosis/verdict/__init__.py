"""The one look at the held-out part, and the verdict of both parts."""
