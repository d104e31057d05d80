# SPDX-License-Identifier: BSD-3-Clause
"""What pyproject.toml cannot say: the version is that of package.xml, the extension is built by CMake."""
import os
import pathlib
import re
import shutil
import subprocess
import sys

from setuptools import Extension, setup
from setuptools.command.build_ext import build_ext

ROOT = pathlib.Path(__file__).resolve().parent
THREE = pathlib.Path("/usr/share/javascript/three/three.min.js")


class CMakeBuild(build_ext):
    """The extension and the core beside it, which it finds by $ORIGIN."""

    def build_extension(self, ext):
        build = pathlib.Path(os.environ.get("CONTACT_FLOW_BUILD", self.build_temp)).resolve()
        subprocess.run(
            ["cmake", "-S", str(ROOT), "-B", str(build), "-DCMAKE_BUILD_TYPE=Release",
             "-DCONTACT_FLOW_ROS=OFF", "-DCONTACT_FLOW_PYTHON=ON", "-DCONTACT_FLOW_BENCHMARKS=OFF",
             "-DBUILD_TESTING=OFF", "-DCMAKE_BUILD_WITH_INSTALL_RPATH=ON",
             "-DPython3_EXECUTABLE=" + sys.executable, "-DPYTHON_EXECUTABLE=" + sys.executable], check=True)
        subprocess.run(["cmake", "--build", str(build), "--target", "contact_flow_python",
                        "--parallel", str(os.cpu_count() or 1)], check=True)
        target = pathlib.Path(self.get_ext_fullpath(ext.name))
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(str(next((build / "python" / "contact_flow").glob("_core*.so"))), str(target))
        for library in build.glob("libcontact_flow.so.*"):
            if not library.is_symlink():
                continue   # the name that the extension asks for is a link to the file
            shutil.copy(str(library.resolve()), str(target.parent / library.name))
        if THREE.is_file():   # for reports where libjs-three is not installed; its licence is in report_three.py
            shutil.copy(str(THREE), str(target.parent / THREE.name))


setup(version=re.search("<version>(.*?)</version>", (ROOT / "package.xml").read_text()).group(1),
      ext_modules=[Extension("contact_flow._core", sources=[])],
      cmdclass={"build_ext": CMakeBuild},
      options={"build": {"build_base": "build/wheel"}})   # build/ is CMake's
