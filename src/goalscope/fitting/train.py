"""The steps of a fit, whatever the loss: AdamW, and a state on disk that survives."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Callable, Generator, Iterable, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from filelock import FileLock, Timeout

from goalscope.base.optional_packages import package
from goalscope.base.types import GoalscopeError, InvalidInputError
from goalscope.fitting.learner import Learner

KEPT = 10
"""Steps between saved states."""

_WARM_UP = 0.05  # share of the steps in which the learning rate rises
_CLIP = 1.0  # largest norm of a gradient
_STATE = "state.pt"


class Training:
    """The steps of one fit.

    Attributes:
        step: Number of steps done.
    """

    def __init__(
        self,
        learner: Learner,
        *,
        learning_rate: float,
        steps: int,
        folder: Path,
        about: Mapping[str, Any],
    ) -> None:
        """Prepare a fit; `resume` continues an interrupted one.

        Args:
            learner: The model.
            learning_rate: Peak learning rate; it decays to nearly 0.
            steps: Total number of steps.
            folder: Folder of the state.
            about: What must be equal to resume an interrupted fit, as JSON.
        """
        self.step = 0
        self._learner, self._rate, self._steps = learner, learning_rate, steps
        self._about: dict[str, Any] = json.loads(json.dumps(about))
        self._file = folder / _STATE
        self._optimizer = package("torch").optim.AdamW(
            learner.parameters, lr=learning_rate, betas=(0.9, 0.98), weight_decay=0.01
        )

    def learn(self, losses: Iterable[Any]) -> float:
        """Take one gradient step on the sum of the losses, and return the sum.

        The graph of each loss is freed before the next is computed.

        Raises:
            GoalscopeError: Memory ran out, or a loss or gradient is not finite.
        """
        share = (self.step + 1) / self._steps
        rate = self._rate * min(share / _WARM_UP, (1 - share) / (1 - _WARM_UP) + 0.01)
        for group in self._optimizer.param_groups:
            group["lr"] = rate
        self._optimizer.zero_grad()
        total = 0.0
        with self._learner.enough_memory():
            for loss in losses:
                loss.backward()
                total += float(loss.detach())
            parameters = self._learner.parameters
            norm = float(package("torch").nn.utils.clip_grad_norm_(parameters, _CLIP))
            if not math.isfinite(total + norm):
                raise diverged(self.step + 1)
            self._optimizer.step()
        self.step += 1
        return total

    def keep(self, **more: Any) -> None:
        """Write the state and other data atomically.

        Raises:
            GoalscopeError: It cannot be written.
        """
        part = self._file.with_suffix(".part")
        state = {
            "about": json.dumps(self._about),
            "step": self.step,
            "weights": self._learner.state(),
            "optimizer": self._optimizer.state_dict(),
            **more,
        }
        try:
            with part.open("wb") as file:
                package("torch").save(state, file)
                file.flush()
                os.fsync(file.fileno())
            os.replace(part, self._file)
        except (OSError, RuntimeError) as error:
            raise GoalscopeError(
                f"Cannot write {self._file} ({error}). Free some space; the same command "
                "resumes from the previous state."
            ) from None

    def resume(self, take: Callable[[Mapping[str, Any]], None]) -> None:
        """Continue from the state in the folder, if there is one; `take` receives the other data.

        Raises:
            InvalidInputError: The state is damaged, or belongs to another fit.
        """
        if not self._file.exists():
            return
        try:
            state = package("torch").load(self._file, map_location="cpu", weights_only=True)
            about = dict(json.loads(state["about"]))
            other = [
                key for key in {**about, **self._about} if about.get(key) != self._about.get(key)
            ]
            if not other:
                take(state)
                self.step = state["step"]
                self._learner.restore(state["weights"])
                self._optimizer.load_state_dict(state["optimizer"])
        except Exception as error:  # whatever unpickling, unzipping and foreign content raise
            raise InvalidInputError(
                f"{self._file} is not the state of an interrupted fit ({error}). Delete it, or "
                "name another folder with --out."
            ) from None
        if other:
            raise InvalidInputError(
                f"{self._file.parent} has a fit that was started with another "
                f"{' and another '.join(other)}. Use the same options to resume it, or name "
                "another folder with --out."
            )


def diverged(step: int) -> GoalscopeError:
    """The error of a fit whose loss is not finite."""
    return GoalscopeError(
        f"The loss is not finite at step {step}. Try a smaller --learning-rate, and another --out."
    )


def check_folder(folder: Path) -> None:
    """Accept a folder that is new, empty, or holds an interrupted fit.

    Raises:
        InvalidInputError: It is a file, or contains something else.
    """
    if folder.exists() and not folder.is_dir():
        raise InvalidInputError(f"{folder} is a file. Name a new folder with --out.")
    held = sorted(each.name for each in folder.iterdir()) if folder.exists() else []
    others = [name for name in held if name not in (".lock", "state.part")]
    if others and _STATE not in held:
        found = "a finished adapter" if "adapter.gguf" in held else others[0]
        raise InvalidInputError(
            f"{folder} contains {found} but no interrupted fit. Name a new folder with --out."
        )


@contextmanager
def locked(folder: Path) -> Generator[None]:
    """Create the folder, and lock it against other fits.

    Raises:
        InvalidInputError: Another process fits in it, or it contains something else.
        OSError: It cannot be written.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        lock = FileLock(folder / ".lock")
        lock.acquire(blocking=False)
    except Timeout:
        raise InvalidInputError(f"Another process is fitting an adapter in {folder}.") from None
    try:
        check_folder(folder)
        yield
    finally:
        lock.release()
        Path(lock.lock_file).unlink(missing_ok=True)


@contextmanager
def writing_to(folder: Path) -> Generator[None]:
    """A context for writing the finished adapter; afterwards the state is deleted.

    Raises:
        GoalscopeError: The folder cannot be written.
    """
    try:
        yield
        (folder / _STATE).unlink(missing_ok=True)
    except OSError as error:
        raise GoalscopeError(
            f"Cannot write the adapter to {folder}: {error.strerror or error}. Free some "
            "space; the same command resumes from the saved state."
        ) from None
