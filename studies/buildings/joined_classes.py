"""Values of a year that follow from all pieces together, joined by motion, with each class at a level of its own."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...core.aliases import Array, Index
from .modelling import ShiftedLevels, joined
from .outcomes import JointFlags

DOWNTIME = "downtime"


class JoinedClasses(ABC):
    """Values (row, level, motion) of pieces together, by the classes of the pieces."""

    @property
    @abstractmethod
    def labels(self) -> list[str]:
        """The classes on which the values depend, at least one."""

    @property
    @abstractmethod
    def together(self) -> Array:
        """The values with all classes at the same level (row, level, motion)."""

    @abstractmethod
    def blurred(self, states: ShiftedLevels) -> Array:
        """Return the means (row, point, motion) with independent scores of the classes."""

    @abstractmethod
    def at(self, states: Mapping[str, Index]) -> Array:
        """Return the values (row, case, motion) with each class in a state (case,), as of `ShiftedLevels`."""


@dataclass(frozen=True)
class JoinedEvent(JoinedClasses):
    """The probability that anything of a set falls; nothing: P(nothing of a class | motion) (row, level, motion)."""

    nothing: Mapping[str, Array]

    @property
    def labels(self) -> list[str]:
        return list(self.nothing)

    @property
    def together(self) -> Array:
        return np.asarray(1.0 - np.prod(list(self.nothing.values()), axis=0))

    def blurred(self, states: ShiftedLevels) -> Array:
        return np.asarray(1.0 - np.prod([states.of(one, 1.0) for one in self.nothing.values()], axis=0))

    def at(self, states: Mapping[str, Index]) -> Array:
        stays = np.ones(())
        for label, one in self._of_states.items():
            stays = stays * one[:, states[label]]
        return np.asarray(1.0 - stays)

    @cached_property
    def _of_states(self) -> dict[str, Array]:
        return {label: np.concatenate([np.ones_like(one[:, :1]), one], axis=1) for label, one in self.nothing.items()}


@dataclass(frozen=True)
class JoinedDowntime(JoinedClasses):
    """The longest downtime of what falls, a mean over its draws; seed: of the scores of the classes."""

    joint: JointFlags
    seed: int

    @property
    def labels(self) -> list[str]:
        return list(self._outcomes)

    @property
    def together(self) -> Array:
        return np.asarray(np.max(list(self._outcomes.values()), axis=0).mean(axis=-1))

    def blurred(self, states: ShiftedLevels) -> Array:
        return np.asarray(joined(self.joint, states, self.seed).expected[DOWNTIME][0])

    def at(self, states: Mapping[str, Index]) -> Array:
        rows = []
        for row in range(self.joint.members.shape[0]):  # (of one place at a time, which bounds the memory)
            longest = np.zeros(())
            for label, one in self._outcomes.items():
                none = np.zeros_like(one[row, :1])
                longest = np.maximum(longest, np.concatenate([none, one[row]])[states[label]])
            rows.append(longest.mean(axis=-1))
        return np.stack(rows)

    @cached_property
    def _outcomes(self) -> dict[str, Array]:
        """The longest downtime of each class (row, level, motion, realisation)."""
        rows = self.joint.inventory.rows
        found = {}
        for label in dict.fromkeys(row.class_label for row in rows):
            lines = [i for i, row in enumerate(rows) if row.class_label == label and not row.anchored]
            part = self.joint.part(np.array(lines, dtype=np.int64))
            if part is not None and any(row.downtime is not None for row in part.inventory.rows):
                found[label] = part.results.outcomes[DOWNTIME][0]
        if not found:
            found[""] = np.zeros((self.joint.members.shape[0], *self.joint.flags.shape[3:], 1))
        return found
