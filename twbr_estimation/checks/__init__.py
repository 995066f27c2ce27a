"""Whether the data of a robot agree with each other, with physics and with its description."""
