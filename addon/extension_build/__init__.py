"""The steps of addon/package.py. No part of the extension: packaging leaves this folder out."""
