"""Parts of the campaign: a file each, with `rows(effort)`, found by its name."""
