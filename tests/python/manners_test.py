#!/usr/bin/env python3
"""How calls behave beside other things that a program does: threads, signals, fork, progress, exceptions."""

import multiprocessing
import os
import pathlib
import signal
import subprocess
import sys
import threading
import time
import unittest

import castor
import numpy as np
from shapes import box, random_rays, sphere

# In which an interruption ends a call. A busy machine may take longer, so the best of some attempts counts.
SECONDS = 0.3
ATTEMPTS = 5


def long_batch(tracer):
    """Rays that keep the devices busy for some seconds."""
    rays = random_rays(1 << 18)
    tracer.any_hit(rays)  # kernels are compiled
    started = time.perf_counter()
    tracer.any_hit(rays)
    repeats = 1 + int(3 / (time.perf_counter() - started))
    return castor.make_rays(*np.split(np.tile(rays, (repeats, 1)), 2, axis=1))


class Interruption(Exception):
    pass


def interrupted(call, number=signal.SIGINT, after=0.3):
    """Calls, sends this process a signal meanwhile, and returns the exception and how long it took after the signal: at
    best, of some attempts."""
    seconds = []
    for _ in range(ATTEMPTS):
        error, taken = interrupt(call, number, after)
        seconds.append(taken)
        if error is None or taken < SECONDS:
            break
    return error, min(seconds)


def interrupt(call, number, after):
    sent = []

    def send():
        time.sleep(after)
        sent.append(time.perf_counter())
        os.kill(os.getpid(), number)

    sender = threading.Thread(target=send)
    sender.start()
    try:
        call()
    except (KeyboardInterrupt, Interruption) as error:
        return error, time.perf_counter() - sent[0]
    finally:
        sender.join()
    return None, 0.0


class Manners(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.scene = castor.Scene.from_mesh(*sphere(64, 128))
        cls.scene.add_default_view()
        cls.tracer = castor.Tracer(cls.scene)
        cls.batch = long_batch(cls.tracer)

    def test_an_interruption_ends_a_batch(self):
        for call in (self.tracer.closest_hit, self.tracer.count, self.tracer.list):
            error, seconds = interrupted(lambda: call(self.batch))
            self.assertIsInstance(error, KeyboardInterrupt)
            self.assertLess(seconds, SECONDS)
        rays = self.batch[:1000]  # the tracer goes on
        np.testing.assert_array_equal(self.tracer.count(rays) > 0, self.tracer.any_hit(rays))

    def test_an_exception_of_another_signal_handler_ends_a_batch(self):
        def raise_it(number, frame):
            raise Interruption(number)

        before = signal.signal(signal.SIGUSR1, raise_it)
        try:
            error, seconds = interrupted(lambda: self.tracer.closest_hit(self.batch), signal.SIGUSR1)
        finally:
            signal.signal(signal.SIGUSR1, before)
        self.assertIsInstance(error, Interruption)
        self.assertLess(seconds, SECONDS)

    def test_a_signal_that_is_handled_ends_nothing(self):
        seen = []
        before = signal.signal(signal.SIGUSR1, lambda number, frame: seen.append(time.perf_counter()))
        try:
            error, _ = interrupted(lambda: self.tracer.any_hit(self.batch[: len(self.batch) // 3]), signal.SIGUSR1, 0.1)
            ended = time.perf_counter()
        finally:
            signal.signal(signal.SIGUSR1, before)
        self.assertIsNone(error)
        self.assertLess(seen[0], ended)

    def test_an_interruption_ends_a_render(self):
        renderer = castor.Renderer(self.scene)
        renderer.render(self.scene.cameras[0].resized(64, 64))  # kernels are compiled
        camera = self.scene.cameras[0].resized(2048, 2048)
        error, seconds = interrupted(lambda: renderer.render(camera, samples_per_pixel=256))
        self.assertIsInstance(error, KeyboardInterrupt)
        self.assertLess(seconds, SECONDS)
        self.assertTrue(renderer.render(camera.resized(32, 32)).complete)

    def test_progress(self):
        renderer, fractions = castor.Renderer(self.scene), []
        threads = set()

        def look(fraction):
            threads.add(threading.get_ident())
            fractions.append(fraction)

        renderer.render(self.scene.cameras[0].resized(512, 512), samples_per_pixel=16, progress=look)
        self.assertEqual(fractions, sorted(fractions))
        self.assertEqual(fractions[-1], 1)
        self.assertEqual(threads, {threading.get_ident()})

        def stop(fraction):
            raise Interruption(fraction)

        with self.assertRaises(Interruption):
            renderer.render(self.scene.cameras[0].resized(2048, 2048), samples_per_pixel=256, progress=stop)
        with self.assertRaises(Interruption):
            castor.Tracer(self.scene, progress=stop)
        with self.assertRaisesRegex(castor.UsageError, "progress: found 'yes', expected True"):
            renderer.render(progress="yes")

    def test_devices_work_while_python_does(self):
        """The GIL is free during a batch: this thread counts on."""
        done = threading.Event()

        def trace():
            self.tracer.any_hit(self.batch[: len(self.batch) // 4])
            done.set()

        thread = threading.Thread(target=trace)
        thread.start()
        turns, longest, last = 0, 0.0, time.perf_counter()
        while not done.is_set():
            time.sleep(0.001)
            now = time.perf_counter()
            turns, longest, last = turns + 1, max(longest, now - last), now
        thread.join()
        self.assertGreater(turns, 20)
        self.assertLess(longest, 1.0)

    def test_threads_share_a_tracer(self):
        rays = self.batch[: 1 << 14].reshape(16, -1, 8)
        expected = [self.tracer.closest_hit(part).tobytes() for part in rays]
        found = [None] * len(rays)

        def trace(i):
            found[i] = self.tracer.closest_hit(rays[i]).tobytes()

        def fail(i):
            with self.assertRaisesRegex(castor.UsageError, f"no device {i}"):
                castor.devices(f"no device {i}")

        threads = [threading.Thread(target=task, args=(i,)) for i in range(len(rays)) for task in (trace, fail)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(found, expected)

    def test_a_forked_child_is_told(self):
        pipe, end = os.pipe()
        child = os.fork()
        if child == 0:
            try:
                self.tracer.any_hit(self.batch[:1])
            except castor.DeviceError as error:
                os.write(end, str(error).encode())
            finally:
                os._exit(0)
        os.close(end)
        with os.fdopen(pipe) as message:
            self.assertIn("fork() after its parent had used OpenCL", message.read())
        os.waitpid(child, 0)

    def test_a_spawned_child_traces(self):
        with multiprocessing.get_context("spawn").Pool(1) as pool:
            self.assertEqual(pool.apply(count_of_a_box), [2])

    def test_a_child_that_was_forked_before_traces(self):
        script = ("import os, castor, numpy as np\n"
                  "child = os.fork()\n"
                  "if child:\n"
                  "    os._exit(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))\n"
                  "scene = castor.Scene.from_mesh(np.eye(3), [[0, 1, 2]])\n"
                  "assert castor.Tracer(scene).any_hit(castor.make_rays((9, 9, 9), (-1, -1, -1)))\n")
        subprocess.run([sys.executable, "-c", script], check=True, timeout=300)

    def test_imports_are_few(self):
        script = ("import castor, castor.trimesh, castor.open3d, sys\n"
                  "print('trimesh' in sys.modules, 'open3d' in sys.modules)")
        done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True, timeout=300)
        self.assertEqual(done.stdout.split(), ["False", "False"])

    def test_a_missing_device_says_what_to_install(self):
        script = "import castor\ntry: castor.Tracer(castor.Scene())\nexcept castor.DeviceError as error: print(error)"
        done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=300, check=True,
                              env={**os.environ, "OCL_ICD_VENDORS": "/nowhere/"})
        self.assertRegex(done.stdout, "no OpenCL device. Install a driver")


def count_of_a_box():
    return castor.Tracer(castor.Scene.from_mesh(*box())).count(castor.make_rays([[0.3, 0.5, 3]], (0, 0, -1))).tolist()


if __name__ == "__main__":
    sys.path.insert(0, str(pathlib.Path(__file__).parent))
    unittest.main()
