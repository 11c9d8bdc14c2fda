"""The demo scene: an underground cistern of columns, vaults and still water, lit by hundreds of lamps and the sky."""
