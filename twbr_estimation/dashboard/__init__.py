"""A web page for one robot or several: live from the graph, or from a recording."""
