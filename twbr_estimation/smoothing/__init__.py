"""Smoothing: the tilt with hindsight, from a whole recording."""

from .smoother import SMOOTHER as SMOOTHER
from .smoother import Progress as Progress
from .smoother import SmoothedTrack as SmoothedTrack
from .smoother import smooth as smooth
