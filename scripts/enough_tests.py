"""Fail unless a JUnit report holds enough tests that ran: `enough_tests.py REPORT NUMBER`."""

import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path


def ran(report: Path) -> int:
    """Return how many tests of a JUnit report were executed, skipped ones left out."""
    suites = ElementTree.parse(report).getroot().iter('testsuite')
    return sum(int(s.get('tests', 0)) - int(s.get('skipped', 0)) for s in suites)


def main(report: str, least: str) -> int:
    """Say what ran; return 1 where that is too little."""
    number = ran(Path(report))
    print(f'{number} tests ran, at least {least} have to')
    return int(number < int(least))


if __name__ == '__main__':
    sys.exit(main(*sys.argv[1:]))
