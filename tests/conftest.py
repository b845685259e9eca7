"""Lets every test import the helpers beside this file: pytest puts its folder on the path."""
