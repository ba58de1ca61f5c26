#!/usr/bin/env python3
"""host/python/generate reads all of castor_c.h, and lays structs out as a C compiler does.

    tests/python/header_test.py C_COMPILER
"""

import ctypes
import importlib.machinery
import importlib.util
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
HEADER = ROOT / "include/castor/castor_c.h"
COMPILER = sys.argv.pop(1) if len(sys.argv) > 1 and not sys.argv[1].startswith("-") else "cc"


def load(name, path):
    loader = importlib.machinery.SourceFileLoader(name, str(path))
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader(name, loader))
    loader.exec_module(module)
    return module


class Generated(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.folder.cleanup)
        cls.path = pathlib.Path(cls.folder.name)
        sys.dont_write_bytecode = True
        subprocess.run([sys.executable, ROOT / "host/python/generate", HEADER, cls.path / "made.py"], check=True)
        cls.made = load("made", cls.path / "made.py")

    def test_every_function_is_there(self):
        declared = set(re.findall(r"\b(castor_\w+)\(", re.sub(r"//.*", "", HEADER.read_text())))
        self.assertGreater(len(declared), 80)
        self.assertEqual(set(self.made.SIGNATURES), declared)

    def test_constants_and_layouts_are_the_compilers(self):
        lines = ['#include <stddef.h>', '#include <stdio.h>', '#include "castor/castor_c.h"', "int main(void) {"]
        expected = []
        for name in (n for n in self.made.__all__ if n.startswith("CASTOR_")):
            lines.append(f'    printf("%s %lld\\n", "{name}", (long long){name});')
            expected.append(f"{name} {getattr(self.made, name)}")
        for name in self.made.STRUCTS:
            struct = getattr(self.made, name)
            lines.append(f'    printf("%s %zu\\n", "{name}", sizeof({name}));')
            expected.append(f"{name} {ctypes.sizeof(struct)}")
            for field, *_ in struct._fields_:
                lines.append(f'    printf("%s.%s %zu %zu\\n", "{name}", "{field}", offsetof({name}, {field}), '
                             f"sizeof((({name}*)0)->{field}));")
                place = getattr(struct, field)
                expected.append(f"{name}.{field} {place.offset} {place.size}")
        source, program = self.path / "layout.c", self.path / "layout"
        source.write_text("\n".join([*lines, "    return 0;", "}", ""]))
        subprocess.run([COMPILER, "-I", ROOT / "include", source, "-o", program], check=True)
        told = subprocess.run([program], capture_output=True, text=True, check=True).stdout.splitlines()
        self.assertEqual(told, expected)

    def test_what_it_does_not_know_is_refused(self):
        header, out = self.path / "odd.h", self.path / "odd.py"
        for text in ("typedef union { int a; } castor_u;", "CASTOR_C_API castor_unknown castor_f(void);",
                     "enum { CASTOR_A };", "typedef struct castor_s { int a : 3; } castor_s;"):
            header.write_text(text)
            done = subprocess.run([sys.executable, ROOT / "host/python/generate", header, out], capture_output=True,
                                  text=True, check=False)
            self.assertEqual(done.returncode, 1, text)
            self.assertIn("odd.h: not understood", done.stderr)


if __name__ == "__main__":
    unittest.main()
