"""The C library: found, checked and called. Everything else in the package goes through here."""

from __future__ import annotations

import ctypes
import importlib
import os
import pathlib
import sys
import threading
import warnings
from typing import Any, Callable, Generator, Iterable, NoReturn, Optional

from . import _c, _drivers
from ._errors import DeviceError, Error, FileError, SceneError, SceneWarning, UsageError

#: Progress as callers give it: a function of the fraction that is done, True for a bar, None for nothing.
Progress = Optional["bool | Callable[[float], object]"]


def _load() -> ctypes.CDLL:
    folder = pathlib.Path(__file__).parent
    path = folder / "libcastor_c.so.0"
    if not path.exists():
        raise ImportError(f"castor: found no {path.name} in {folder}: install the package with pip, or put the folder "
                          "host/python of a finished build first in PYTHONPATH")
    _drivers.load_opencl(folder)
    library = ctypes.CDLL(str(path))
    _c.declare(library)
    for name in _c.STRUCTS:
        bytes_there = ctypes.c_size_t()
        status = library.castor_get_struct_size(name.encode(), ctypes.byref(bytes_there))
        bytes_here = ctypes.sizeof(getattr(_c, name))
        if status != _c.CASTOR_STATUS_DONE or bytes_there.value != bytes_here:
            raise ImportError(f"castor: {path} has {bytes_there.value} bytes in its {name}, this package {bytes_here}: "
                              "they are of different versions")
    return library


lib = _load()

# Drivers have threads, which fork() does not copy: a child of a process that used one would wait for ever.
_drivers_used = False
_forked_after_use = False


def _after_fork() -> None:
    global _forked_after_use
    _forked_after_use = _forked_after_use or _drivers_used


os.register_at_fork(after_in_child=_after_fork)


def check_process() -> None:
    """Called before everything that uses drivers."""
    global _drivers_used
    if _forked_after_use:
        raise DeviceError("castor: this process was made by fork() after its parent had used OpenCL, whose drivers do "
                          "not survive that: start processes by 'spawn' or 'forkserver' (multiprocessing), or fork "
                          "before the first call that uses a device")
    _drivers_used = True


def text(value: Optional[bytes]) -> str:
    """A string of the library."""
    return (value or b"").decode("utf-8", "replace")


def fail(status: int) -> NoReturn:
    """Raises this thread's last error."""
    error = _c.castor_error(size=ctypes.sizeof(_c.castor_error))
    lib.castor_get_last_error(ctypes.byref(error))
    message = text(error.message)
    if status == _c.CASTOR_STATUS_SCENE_ERROR:
        raise SceneError(message, text(error.file), int(error.line))
    if status == _c.CASTOR_STATUS_USAGE_ERROR:
        raise UsageError(message)
    if status == _c.CASTOR_STATUS_DEVICE_ERROR:
        raise DeviceError(message + _drivers.advice(), text(error.device), text(error.call), int(error.code))
    if status == _c.CASTOR_STATUS_FILE_ERROR:
        raise FileError(message, text(error.file))
    if status == _c.CASTOR_STATUS_OUT_OF_MEMORY:
        raise MemoryError(message)
    raise Error(message)


def check(status: int) -> None:
    if status != _c.CASTOR_STATUS_DONE:
        fail(status)


class Handle:
    """One reference to an object of the library, given back when Python drops the handle. The library writes the
    reference into `out()`, so that none is lost where an exception comes between."""

    def __init__(self, kind: str) -> None:
        self._pointer = ctypes.c_void_p()
        self._release = getattr(lib, f"castor_{kind}_release")

    def out(self) -> Any:
        return ctypes.byref(self._pointer)

    @property
    def value(self) -> Optional[int]:
        return self._pointer.value

    def __del__(self) -> None:
        # A fork's copy shares drivers that are gone; what it holds goes with the process.
        if self._pointer.value and not _forked_after_use:
            self._release(self._pointer)


def choose(word: str, words: dict[str, int], name: str) -> int:
    """The library's number of a word."""
    if word not in words:
        raise UsageError(f"{name}: found {word!r}, expected one of {', '.join(words)}")
    return words[word]


def struct(name: str, /, **fields: Any) -> Any:
    """A struct of the header with its size and these fields set, and zeros elsewhere."""
    made = getattr(_c, name)(size=ctypes.sizeof(getattr(_c, name)))
    for field, value in fields.items():
        if value is not None:
            setattr(made, field, value)
    return made


def ask(function: str, name: str, *arguments: Any) -> Any:
    """The struct that a function of the library fills in."""
    answer = struct(name)
    check(getattr(lib, function)(*arguments, ctypes.byref(answer)))
    return answer


def count(function: str, handle: Handle) -> int:
    """The number that a function of the library tells of a handle."""
    answer = ctypes.c_size_t()
    check(getattr(lib, function)(handle.value, ctypes.byref(answer)))
    return answer.value


def warnings_of(kind: str, handle: Handle) -> list[str]:
    """The warnings of a handle, each as a sentence with its file and line."""
    sentences = []
    for i in range(count(f"castor_{kind}_get_warning_count", handle)):
        warning = ask(f"castor_{kind}_get_warning", "castor_warning", handle.value, i)
        place = text(warning.file) + (f":{warning.line}" if warning.line else "")
        sentences.append(f"{place}: {text(warning.text)}" if place else text(warning.text))
    return sentences


def warn(sentences: Iterable[str]) -> None:
    """Reports warnings at the caller's line: the first frame that is not the package's."""
    here = str(pathlib.Path(__file__).parent)
    level, frame = 1, sys._getframe()
    while frame.f_back and frame.f_code.co_filename.startswith(here):
        level, frame = level + 1, frame.f_back
    for sentence in sentences:
        warnings.warn(sentence, SceneWarning, stacklevel=level)


class GoOn:
    """A `castor_go_on_function` that lets the thread that waits for a batch notice signals.

    Python handles signals where a function begins, before its first `try`: an exception that a handler raises would be
    lost there, at the border to C. A generator goes on inside its `try`.
    """

    def __init__(self) -> None:
        self._error: Optional[BaseException] = None
        watch = self._watch()
        next(watch)
        self._function = _c.castor_go_on_function(watch.send)
        self._options = struct("castor_batch_options", go_on=self._function)

    @property
    def stopped(self) -> bool:
        """It has stopped a batch, and is of no further use."""
        return self._error is not None

    def options(self, coherent: bool) -> Any:
        self._options.coherence = int(coherent)
        return ctypes.byref(self._options)

    def _watch(self) -> Generator[int, Any, None]:
        try:
            while True:
                yield 1
        except GeneratorExit:
            return
        except BaseException as error:  # of any kind: it goes on in the caller
            self._error = error
        while True:
            yield 0

    def finish(self, status: int) -> None:
        if self._error is not None:
            raise self._error
        check(status)


def call_with_progress(call: Callable[[Any], int], prototype: Any, fraction: Callable[..., Any], progress: Progress,
                       title: str) -> None:
    """Calls a long function of the library.

    `call` gets the callback to hand over, a `prototype`; `fraction` makes of the callback's arguments what is done. The
    call runs in a thread of its own, so that this thread can handle signals and runs the caller's `progress`, whose
    exceptions stop the call and go on from here.
    """
    done, finished = [0.0], threading.Event()
    going_on = [1]
    errors: list[BaseException] = []

    def tell(*arguments: Any) -> int:
        done[0] = fraction(*arguments)
        return going_on[0]

    def run() -> None:
        try:
            check(call(callback))  # here, since the library keeps errors by thread
        except BaseException as error:
            errors.append(error)
        finally:
            finished.set()

    callback = prototype(tell)
    worker = threading.Thread(target=run, name=f"castor: {title}")
    worker.start()
    try:
        with _Bar(progress, title) as bar:
            while not finished.wait(0.05):
                bar.show(done[0])
            if not errors:
                bar.show(1.0)
    except BaseException:
        going_on[0] = 0
        raise
    finally:
        _join(worker)
    if errors:
        raise errors[0]


def _join(worker: threading.Thread) -> None:
    """Waits until a thread has ended, however often the user interrupts: its memory is in use till then."""
    interruption: Optional[KeyboardInterrupt] = None
    while worker.is_alive():
        try:
            worker.join()
        except KeyboardInterrupt as error:
            interruption = error
    if interruption is not None:
        raise interruption


class _Bar:
    """Shows progress as the caller wants it."""

    def __init__(self, progress: Progress, title: str) -> None:
        self._function: Optional[Callable[[float], object]] = progress if callable(progress) else None
        self._bar: Any = None
        self._shown = 0.0
        if progress is True:
            try:
                tqdm = importlib.import_module("tqdm.auto").tqdm
            except ImportError:
                self._function = lambda done: print(f"\r{title}: {100 * done:3.0f} %", end="\n" if done == 1 else "",
                                                    file=sys.stderr)
            else:
                self._bar = tqdm(total=100, desc=title, bar_format="{l_bar}{bar}| {elapsed}<{remaining}")
        elif progress not in (None, False) and not callable(progress):
            raise UsageError(f"progress: found {progress!r}, expected True, a function of the fraction done, or None")

    def show(self, done: float) -> None:
        if done <= self._shown:
            return
        if self._bar is not None:
            self._bar.update(100 * (done - self._shown))
        if self._function is not None:
            self._function(done)
        self._shown = done

    def __enter__(self) -> _Bar:
        return self

    def __exit__(self, *error: object) -> None:
        if self._bar is not None:
            self._bar.close()
