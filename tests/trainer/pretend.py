"""A pretended graphics card: tensors that only count as being there, and refusal of whatever a real one refuses."""

from typing import Any

import torch
from torch import Tensor
from torch.overrides import TorchFunctionMode

CARD = torch.device("cuda")
# What may be given tensors of both; the first of them says where the result is.
_MIXES = {"copy_", "__setitem__", "__getitem__", "__get__", "__set__", "_has_compatible_shallow_copy_type"}


class DevicesMixed(Exception):  # noqa: N818 - it reports what was done
    """Something was given tensors of the computer and of the card together."""


class PretendedCard(TorchFunctionMode):
    """While it is open, tensors moved to `cuda`, or made from such ones, count as being there.

    As with a real card: operations take tensors of one device only, except for single numbers; a card's tensor is
    indexed by either kind, the computer's by its own; NumPy sees the computer's alone.

    Attributes:
        moved: how many tensors were copied to the card, and back from it.
    """

    def __init__(self) -> None:
        super().__init__()
        self._there: dict[int, Any] = {}
        self.moved = {"there": 0, "back": 0}

    def is_there(self, tensor: Tensor) -> bool:
        with torch._C.DisableTorchFunction():
            return tensor.untyped_storage()._cdata in self._there

    def _put(self, tensor: Tensor) -> Tensor:
        with torch._C.DisableTorchFunction():
            storage = tensor.untyped_storage()
        self._there[storage._cdata] = storage  # kept, so that its address stays its own
        return tensor

    def __torch_function__(self, func: Any, types: Any, args: Any = (), kwargs: Any = None) -> Any:
        kwargs = dict(kwargs or {})
        name = getattr(func, "__name__", str(func)).split(".")[0]
        if func == Tensor.device.__get__:
            return CARD if self.is_there(args[0]) else torch.device("cpu")
        if func == Tensor.is_cuda.__get__:
            return self.is_there(args[0])
        if name in ("to", "cpu", "cuda"):
            with torch._C.DisableTorchFunction():
                return self._moved(name, args[0], [*args[1:], *kwargs.values()])
        given = list(_tensors((args, kwargs)))
        there = [self.is_there(tensor) for tensor in given]
        if name == "numpy" and any(there):
            raise TypeError("can't convert cuda device type tensor to numpy")
        self._check(name, given, there)
        asked = torch.device(kwargs.pop("device", None) or "cpu") if "device" in kwargs else None
        result = func(*args, **kwargs)
        on_card = any(there[:1] if name in _MIXES else there) if asked is None else asked.type == "cuda"
        if on_card:
            for tensor in _tensors(result):
                self._put(tensor)
        return result

    def _check(self, name: str, given: list[Tensor], there: list[bool]) -> None:
        if name in _MIXES:
            if name == "__getitem__" and any(there) and not there[0]:
                raise DevicesMixed("indices on the card for a tensor of the computer")
            return
        kinds = {where for tensor, where in zip(given, there, strict=True) if tensor.ndim > 0}
        if len(kinds) > 1:
            raise DevicesMixed(f"{name}: {[(tuple(t.shape), w) for t, w in zip(given, there, strict=True)]}")

    def _moved(self, name: str, source: Tensor, wanted: list[Any]) -> Tensor:
        """What `source.to(*wanted)`, `source.cpu()` or `source.cuda()` gives."""
        was = will = self.is_there(source)
        result = source
        for one in [name] if name != "to" else wanted:
            if isinstance(one, Tensor):
                will = self.is_there(one)
                result = result.to(one.dtype)
            elif isinstance(one, torch.dtype):
                result = result.to(one)
            elif isinstance(one, torch.memory_format):
                result = result.contiguous(memory_format=one)
            elif isinstance(one, str | torch.device):
                will = torch.device(one).type == "cuda"
        if was != will:
            self.moved["there" if will else "back"] += 1
            result = result.clone(memory_format=torch.preserve_format)
        return self._put(result) if will else result


def _tensors(found: Any) -> Any:
    if isinstance(found, Tensor):
        yield found
    elif isinstance(found, dict):
        for value in found.values():
            yield from _tensors(value)
    elif isinstance(found, list | tuple):
        for value in found:
            yield from _tensors(value)
