"""The server of the app: requests in, bytes out; it knows no algorithm."""
