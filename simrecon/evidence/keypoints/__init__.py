"""Outputs of networks that find landmarks in images."""
