"""What people ask for in a house, what they rule out, and what they allow."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from goalscope.envs.house.grammar import Clause, Phrase, clauses, phrases, plain_clauses
from goalscope.envs.house.names import names
from goalscope.envs.house.object_types import object_type
from goalscope.types import Turn

__all__ = ["IRREVERSIBLE", "Hearing", "Request", "ask_permission", "completes", "hear"]
