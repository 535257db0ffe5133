"""The effects there are: those of the catalogue and those that somebody registers."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from actuator_glue.errors import InputError
from actuator_glue.given import of_kind
from actuator_glue.model.effects import coefficients
from actuator_glue.model.effects.effect import Effect
from actuator_glue.model.effects.terms.definition import entries, mapping
from actuator_glue.model.parameters import NAMES as BASE


class Registry(dict[str, Effect]):
    """Effects by name, in the order in which their parameters stand in a model."""

    def __init__(self, effects: Iterable[Effect]) -> None:
        super().__init__()
        self._own: frozenset[str] = frozenset()
        for effect in effects:
            self.register(effect)
        self._own = frozenset(self)

    def register(self, effect: Effect, *, replace: bool = False) -> Effect:
        """Add an effect and return it; to add the same one again changes nothing.

        Args:
            effect: the effect.
            replace: take it in place of another one that was registered under its name.

        Raises:
            InputError: no effect, its name or a parameter's belongs to another effect, or nothing
                uses a parameter.
        """
        of_kind(effect, 'effect', Effect, 'what `term` makes')
        known = self.get(effect.name)
        if known is not None:
            if known == effect:
                return known
            if replace and effect.name not in self._own:
                del self[effect.name]
                try:
                    return self.register(effect)
                except InputError:
                    self[effect.name] = known
                    raise
            raise InputError(
                f'effect {effect.name!r} is there already, with another definition; rename one'
            )
        owner = {p.name: e.name for e in self.values() for p in e.parameters}
        owner.update(dict.fromkeys(BASE, 'Eq. (2)'))
        for p in effect.parameters:
            if p.name in owner:
                raise InputError(
                    f'effect {effect.name!r}: parameter {p.name!r} belongs to {owner[p.name]} '
                    'already; names of parameters are unique, rename it'
                )
            own = effect.expression or effect.output or effect.variance
            if own is None and p.name not in coefficients.NAMES:
                raise InputError(
                    f'effect {effect.name!r}: nothing takes parameter {p.name!r}; it needs an '
                    'expression, an output or a variance'
                )
        self[effect.name] = effect
        return effect

    def take(self, effects: Iterable[Effect]) -> None:
        """Register effects in place of others of the same names.

        Raises:
            InputError: as `register`.
        """
        for effect in effects:
            self.register(effect, replace=True)

    def define(self, content: Any, source: str) -> None:
        """Register effects from their definitions; `source` says where these come from.

        Raises:
            InputError: an effect cannot be used.
        """
        self.take(entries(content, source))

    def definitions(self, names: Iterable[str]) -> dict[str, Any]:
        """Return `{'definitions': ...}` of those effects that are no part of the package, or {}.

        What is kept or sent with it can be read where the file of effects is not at hand.
        """
        wanted = set(names)
        own = mapping(e for e in self.registered() if e.name in wanted)
        return {'definitions': own} if own else {}

    def unregister(self, name: str) -> None:
        """Forget an effect that was registered.

        Raises:
            InputError: there is none of that name, or it belongs to the catalogue.
        """
        if name in self._own or name not in self:
            raise InputError(f'effect {name!r} is not one that was registered')
        del self[name]

    def registered(self) -> tuple[Effect, ...]:
        """Return the effects beyond the catalogue, which other processes must be told of."""
        return tuple(effect for name, effect in self.items() if name not in self._own)

    def searched(self, reserved: bool = False) -> tuple[str, ...]:
        """Return the effects that the diagnosis always tries, or those that it reserves."""
        return tuple(n for n, e in self.items() if e.searched and e.reserved == reserved)
