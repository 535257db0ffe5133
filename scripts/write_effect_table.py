"""Renew the table of docs/effects.md from the effect catalogue (`make docs`)."""

from pathlib import Path

from actuator_glue.model.effects.table import renewed

PAGE = Path(__file__).resolve().parent.parent / 'docs' / 'effects.md'

if __name__ == '__main__':
    PAGE.write_text(renewed(PAGE.read_text(encoding='utf-8')), encoding='utf-8')
