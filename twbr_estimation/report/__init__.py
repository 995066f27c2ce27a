"""What a recording tells, for people: an HTML page, and pictures for slides."""
