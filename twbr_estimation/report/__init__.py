"""Reports on a recording: an HTML page, and pictures for slides."""
