"""What pyproject.toml cannot say: the files by which ROS 2 finds an ament_python package."""

from pathlib import Path

from setuptools import setup

NAME = 'actuator_glue'
LAUNCHED = [
    (f'share/{NAME}/{folder}', [p.as_posix() for p in sorted(Path(folder).glob('*.*'))])
    for folder in (
        'launch',
        'config',
        'config/channels',
        'config/layouts',
        'config/partitions',
        'config/security',
    )
]

setup(
    # As text in [project] it needs setuptools 77; Ubuntu 24.04 has 68, where a table is required
    # that newer ones refuse.
    license='Apache-2.0',
    # colcon prints what it reads and evaluates that again; [project] makes it an object that does
    # not survive this.
    python_requires='>=3.11',
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{NAME}']),
        # colcon runs this file in a folder that holds nothing but links to the package and to
        # what is listed here: [project] and what it reads have to be among them.
        (f'share/{NAME}', ['package.xml', 'pyproject.toml', 'README.md']),
        *LAUNCHED,
    ],
)
