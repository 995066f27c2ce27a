"""The sensors: what they report, and what disturbs them."""
