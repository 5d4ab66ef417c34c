"""Monitoring of machines: samples from files, folders and standard input, and the changes in words."""
