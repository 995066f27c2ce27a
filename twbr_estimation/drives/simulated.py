"""A drive that is simulated."""

from __future__ import annotations

from ..simulation import World
from ..simulation import simulate as simulate_recording
from .drive import Drive


def simulate(
    world: World | str = "paper",
    *,
    seed: int = 1,
    dt: float = 0.002,
    duration: float = 60.0,
    scene: str = "drive",
) -> Drive:
    """Simulate one recording of the rig; the same arguments give the same recording.

    Args:
        world: one of `simulation.WORLDS`, or its name.
        seed: number of the random draw.
        dt: sampling period [s].
        duration: length [s].
        scene: one of `simulation.SCENES`.

    Returns:
        The drive, with the setup that an estimator gets; the truth is
        `drive.recording.truth`.

    Raises:
        ConfigurationError: unknown world or scene, or a time that cannot be simulated.
    """
    return simulate_recording(world, dt, duration, seed, scene).drive
