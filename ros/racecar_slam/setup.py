"""The ROS 2 package of racecar-slam: what `ros2 launch` finds by name. The code itself comes from pip."""

from pathlib import Path

from setuptools import setup

setup(
    name="racecar_slam",
    version="0.2.0",
    packages=[],
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/racecar_slam"]),
        ("share/racecar_slam", ["package.xml"]),
        ("share/racecar_slam/launch", [str(file) for file in Path("launch").iterdir()]),
    ],
)
