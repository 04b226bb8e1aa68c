"""Programs that are written beside an exported team, for it to act without skillcrew."""
