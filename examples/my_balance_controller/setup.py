"""An ament_python package: two nodes."""

from setuptools import setup

NAME = "my_balance_controller"

setup(
    name=NAME,
    version="0.0.0",
    packages=[NAME],
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml"]),
    ],
    install_requires=["setuptools"],
    zip_safe=True,
    maintainer="You",
    maintainer_email="you@example.org",
    description="Balance controllers to copy, fed by twbr_estimation.",
    license="Apache-2.0",
    entry_points={
        "console_scripts": [f"on_tilt = {NAME}.on_tilt:main", f"on_imu = {NAME}.on_imu:main"]
    },
)
