"""What every fit does: steps of AdamW, a state that survives an interruption, a folder."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Callable, Generator, Iterable, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from filelock import FileLock, Timeout

from goalscope.extras import package
from goalscope.fitting.learner import Learner
from goalscope.types import GoalscopeError, InvalidInputError

__all__ = ["KEPT", "Training", "diverged", "locked", "writing_to"]

KEPT = 10
"""Steps after which the state is kept."""

_WARM_UP = 0.05  # of the steps, in which the learning rate rises
_CLIP = 1.0  # largest norm of a gradient


class Training:
    """The steps of one fit.

    Attributes:
        step: Steps done.
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
        """Prepare; `resume` goes on where the folder was left.

        Args:
            learner: The model.
            learning_rate: At its highest; it falls to nearly 0 at the last step.
            steps: In all.
            folder: Where the state is kept.
            about: What a run that goes on must have in common with it, as JSON.
        """
        self.step = 0
        self._learner, self._rate, self._steps = learner, learning_rate, steps
        self._about: dict[str, Any] = json.loads(json.dumps(about))
        self._file = folder / "state.pt"
        self._optimizer = package("torch").optim.AdamW(
            learner.parameters, lr=learning_rate, betas=(0.9, 0.98), weight_decay=0.01
        )

    def learn(self, losses: Iterable[Any]) -> float:
        """Do one step that makes the sum of the losses smaller; that sum.

        Each is let go of before the next one is computed.

        Raises:
            GoalscopeError: The memory is too small, or a loss or gradient is not finite.
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
        """Write the state, and what else there is to be kept, all at once.

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
                f"{self._file} cannot be written ({error}). Free some space; what was kept before "
                "is still there, and the same command goes on from it."
            ) from None

    def resume(self, take: Callable[[Mapping[str, Any]], None]) -> None:
        """Go on from the state in the folder, if there is one; `take` is given what was kept.

        Raises:
            InvalidInputError: The state is broken, or that of another fit.
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
        except Exception as error:  # whatever unpickling, unzipping and a foreign content raise
            raise InvalidInputError(
                f"{self._file} is not what an interrupted fit leaves ({error}). Delete it, or name "
                "another folder with --out."
            ) from None
        if other:
            raise InvalidInputError(
                f"{self._file.parent} holds a fit that was begun with another "
                f"{' and another '.join(other)}. Give the same options to go on, or name another "
                "folder with --out."
            )


def diverged(step: int) -> GoalscopeError:
    """The error of a fit whose loss is not finite."""
    return GoalscopeError(
        f"The loss is not finite at step {step}. Try a smaller --learning-rate, and another --out."
    )


@contextmanager
def locked(folder: Path) -> Generator[None]:
    """Make the folder, and keep other processes from fitting in it.

    Raises:
        InvalidInputError: Another one does.
        GoalscopeError: It cannot be written.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        lock = FileLock(folder / ".lock")
        lock.acquire(blocking=False)
    except Timeout:
        raise InvalidInputError(f"Another process fits an adapter in {folder}.") from None
    except OSError as error:
        raise GoalscopeError(f"{folder} cannot be written: {error.strerror or error}.") from None
    try:
        yield
    finally:
        lock.release()
        Path(lock.lock_file).unlink(missing_ok=True)


@contextmanager
def writing_to(folder: Path) -> Generator[None]:
    """Within it, a folder that cannot be written is a `GoalscopeError`."""
    try:
        yield
    except OSError as error:
        raise GoalscopeError(
            f"The adapter cannot be written to {folder}: {error.strerror or error}. Free some "
            "space; the same command goes on from what is kept."
        ) from None
