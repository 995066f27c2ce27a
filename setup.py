"""Package description; colcon and pip both read this file."""

import re
from pathlib import Path

from setuptools import find_packages, setup

NAME = "twbr_estimation"
ROOT = Path(__file__).resolve().parent  # colcon --symlink-install runs a link to this file
VERSION = re.search(r'__version__ = "(.+)"', (ROOT / NAME / "__init__.py").read_text()).group(1)
NODES = sorted(path.name for path in (ROOT / "scripts").glob("*_node") if path.is_symlink())

CONTROL = ["control>=0.10"]
DASHBOARD = ["nicegui>=2.10"]
DOCS = ["mkdocs-material>=9.5", "mkdocstrings[python]>=0.25"]
DASK = ["distributed>=2023.12"]
NOISE = ["allantools>=2024.4", "matplotlib>=3.6.3"]
PEERS = [
    "vqf>=2.1",
    "imufusion>=1.3",
    "ahrs>=0.4",
    "riann>=0.2",
    "attipy>=0.0.7",
    "gtsam>=4.3; python_version >= '3.11'",  # has no wheels for 3.10
]
PHYSICS = ["mujoco>=3.2"]
REPORT = ["bokeh>=3.4", "Jinja2>=3.1", "matplotlib>=3.6.3"]
SERIAL = ["pyserial>=3.5", "cobs>=1.2"]
TEST = [
    *SERIAL,
    *DASHBOARD,
    "pytest>=7.4",
    "pytest-xdist>=3.5",
    "pytest-cov>=5",
    "hypothesis>=6.98",
    "filterpy>=1.4.5",
    "h5py>=3.10",
    "sympy>=1.12",
    *CONTROL,
    *DASK,
    *NOISE,
    *PHYSICS,
    *REPORT,
]
LINT = ["ruff>=0.6", "mypy>=1.11", "types-PyYAML"]
HARDWARE = ["smbus2>=0.4.3", "gpiod>=2.1"]


def files(pattern: str) -> list[str]:
    """Return files of the checkout as paths relative to it."""
    return sorted(str(path.relative_to(ROOT)) for path in ROOT.glob(pattern))


setup(
    name=NAME,
    version=VERSION,
    description="Tilt estimation for two-wheeled balancing robots from an MPU6050 and encoders",
    long_description=(ROOT / "README.md").read_text(),
    long_description_content_type="text/markdown",
    maintainer="The twbr_estimation maintainers",
    maintainer_email="maintainers@example.org",
    license="Apache-2.0",
    python_requires=">=3.10",
    packages=find_packages(include=[NAME, f"{NAME}.*"]),
    package_data={
        NAME: ["py.typed", "presets/**/*.yaml", "report/*.html", "report/*.js", "dashboard/**/*.js"]
    },
    zip_safe=False,
    install_requires=[
        "numpy>=1.26",
        "scipy>=1.11",
        "numba>=0.58",
        "rosbags>=0.11",
        "mcap>=1.1",
        "zstandard>=0.21",
        "lz4>=4.0",
        "PyYAML>=6",
        "rich>=13",
    ],
    extras_require={
        "ros": ["ros-jazzy-rclpy[fastrtps]", "ros-jazzy-common-interfaces"],
        "hardware": HARDWARE,
        "import": ["h5py>=3.10"],
        "dask": DASK,
        "dashboard": DASHBOARD,
        "docs": DOCS,
        "serial": SERIAL,
        "noise": NOISE,
        "peers": PEERS,
        "physics": PHYSICS,
        "report": REPORT,
        "test": TEST,
        "dev": [*TEST, *LINT, *HARDWARE, *DOCS],
        "colcon": ["colcon-common-extensions", "setuptools<80"],
    },
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml"]),
        (f"share/{NAME}/config", files("config/*.*")),
        (f"share/{NAME}/launch", files("launch/*.launch.py")),
        (f"lib/{NAME}", [f"scripts/{node}" for node in NODES]),
    ],
    entry_points={
        "console_scripts": [
            f"twbr = {NAME}.cli.main:command",
            *(f"{node} = {NAME}.nodes.commands:{node}" for node in NODES),
        ],
    },
)
