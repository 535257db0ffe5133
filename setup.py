"""Package actuator_glue: an ament_python package for colcon, an ordinary one for pip."""

from pathlib import Path

from setuptools import find_packages, setup

NAME = 'actuator_glue'
NODES = ('actuator_sim', 'estimator', 'recorder', 'replay', 'lab_bridge', 'diagnoser')

setup(
    name=NAME,
    version='0.1.0',
    packages=find_packages(include=[NAME, f'{NAME}.*']),
    package_data={
        # `interfaces` is a link to msg_defs/: bags embed these texts, with or without ROS.
        NAME: [
            'interfaces/msg/*.msg',
            'interfaces/srv/*.srv',
            'interfaces/action/*.action',
            'report/*.mplstyle',
            'report/templates/*',
            'py.typed',
        ],
    },
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{NAME}']),
        (f'share/{NAME}', ['package.xml']),
        *(
            (f'share/{NAME}/{folder.as_posix()}', sorted(str(p) for p in files))
            for folder in map(Path, ('launch', 'config', 'config/channels'))
            if (files := [p for p in folder.glob('*.*') if p.is_file()])
        ),
    ],
    install_requires=['setuptools'],
    zip_safe=False,
    maintainer='actuator_glue maintainers',
    maintainer_email='maintainers@actuator-glue.org',
    description='Online Bayesian calibration and diagnosis of servo-hydraulic actuators.',
    license='Apache-2.0',
    entry_points={
        'console_scripts': [
            'actuator-glue = actuator_glue.cli.main:main',
            *(f'{node} = {NAME}.nodes.{node}:main' for node in NODES),
        ],
    },
)
