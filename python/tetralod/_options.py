"""Arguments as the native module takes them: every refusal names the argument."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._errors import bad_option


def numbers(name: str, value: Any, shape: tuple[int | None, ...], what: str) -> NDArray[np.float64]:
    """An array of finite or infinite numbers; ``None`` in a shape stands for any length."""
    try:
        array = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise bad_option(name, f"must be {what}; given: {value!r}") from None
    fits = array.ndim == len(shape) and all(want in (None, has) for want, has in zip(shape, array.shape))
    if not fits or np.isnan(array).any():
        given = f"an array of shape {array.shape}" if array.size > 16 else repr(value)
        raise bad_option(name, f"must be {what}; given: {given}")
    return array


def listed(name: str, value: Any, shape: tuple[int | None, ...], what: str) -> list[float]:
    """The numbers of such an array, row by row."""
    return [float(one) for one in numbers(name, value, shape, what).ravel()]


def number(name: str, value: Any, what: str = "a number") -> float:
    """One number."""
    return float(numbers(name, value, (), what))


def amount(name: str, value: Any) -> float:
    """A finite number that is not negative."""
    result = number(name, value)
    if not 0 <= result < math.inf:
        raise bad_option(name, f"must be a number that is not negative; given: {value!r}")
    return result


def whole(name: str, value: Any, least: int, most: int) -> int:
    """A number without a fraction, of a range."""
    if isinstance(value, (bool, np.bool_)) or not hasattr(value, "__index__") or not least <= value <= most:
        raise bad_option(name, f"must be an integer from {least} to {most}; given: {value!r}")
    return int(value)


def count(name: str, value: Any, most: int) -> int | None:
    """A limit: at least 1. More than an integer can count, infinity included, is no limit."""
    if value is None:
        return None
    result = number(name, value)
    if result < 1:
        raise bad_option(name, f"must be at least 1; given: {value!r}")
    return None if result > most else int(result)


def tolerance(name: str, value: Any, unit: float) -> float:
    """A number in units, or a text such as "1%", as a fraction of ``unit``; not negative."""
    if isinstance(value, str):
        try:
            if not value.strip().endswith("%"):
                raise ValueError
            result = float(value.strip()[:-1]) / 100
        except ValueError:
            raise bad_option(name, f'must be a number, or a percentage such as "1%"; given: {value!r}') from None
    else:
        result = number(name, value, 'a number, or a percentage such as "1%"') / unit
    if not result >= 0:
        raise bad_option(name, f"must not be negative; given: {value!r}")
    return result


def names(name: str, value: Any) -> list[str]:
    """A list of texts."""
    if isinstance(value, (str, bytes)) or not isinstance(value, Iterable):
        raise bad_option(name, f"must be a list of names; given: {value!r}")
    result = list(value)
    if not all(isinstance(one, str) for one in result):
        raise bad_option(name, f"must be a list of names; given: {value!r}")
    return result


def points(name: str, value: Any) -> NDArray[np.float64]:
    """Points in rows: an array (n, 3) of finite numbers, in one piece."""
    array = np.ascontiguousarray(numbers(name, value, (None, 3), "points: an array of shape (n, 3)"))
    if not np.isfinite(array).all():
        raise bad_option(name, "must be finite numbers")
    return array
