"""The same job on many recordings, on as many processes or machines as there are.

`places.recordings_at` finds the recordings; a `jobs.Job` is what is done with each of them, in
parts that do not depend on each other (one filter each); `series.run` has the parts that a
`results.ResultTable` does not hold yet done by workers and appends them as they come. Nothing is
imported here: a command on one recording needs none of it.
"""
