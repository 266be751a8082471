# SPDX-License-Identifier: GPL-3.0-or-later
"""Run by test_vr.py: Blender in a window on a virtual screen, with Monado as its VR runtime.

    python vr_harness.py BLENDER SCRIPT [WORD ...]

No headset and no GPU: Monado's compositor draws nowhere, poses come by TCP from the script (see
monado.py). All that is started has a home, a display, a port and, where the system allows it, a
network of its own, so any number of these run at once. Exit status: Blender's; SKIP where
something is missing, and the last line says what.
"""

from __future__ import annotations

import contextlib
import fcntl
import json
import os
import shutil
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

SKIP = 77
SIZE = os.environ.get("VR_SIZE", "480x360")
SECONDS = float(os.environ.get("VR_SECONDS", "900"))
MANIFEST = Path("/usr/share/openxr/1/openxr_monado.json")
DRIVER = Path("/usr/share/vulkan/icd.d/lvp_icd.json")
SIOCGIFFLAGS, SIOCSIFFLAGS, IFF_UP = 0x8913, 0x8914, 0x1


def unavailable(reason: str) -> None:
    """End with the reason why there is no VR here."""
    print(f"No VR here: {reason}")
    sys.exit(SKIP)


def leave_network() -> None:
    """Have a network of our own, because the driver would listen to anybody's poses."""
    with contextlib.suppress(OSError, AttributeError):
        os.unshare(os.CLONE_NEWNET)
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as any_socket:
            asked = struct.pack("16sh22x", b"lo", 0)
            (flags,) = struct.unpack("16xh22x", fcntl.ioctl(any_socket, SIOCGIFFLAGS, asked))
            fcntl.ioctl(any_socket, SIOCSIFFLAGS, struct.pack("16sh22x", b"lo", flags | IFF_UP))


def free_port() -> int:
    """Return a port that nobody listens at."""
    with socket.socket() as any_socket:
        any_socket.bind(("127.0.0.1", 0))
        return int(any_socket.getsockname()[1])


@contextlib.contextmanager
def running(command: list[str], **options: object) -> Iterator[subprocess.Popen[bytes]]:
    """Start a program, and end it when it is no longer needed."""
    process = subprocess.Popen(command, **options)  # type: ignore[call-overload]
    try:
        yield process
    finally:
        process.send_signal(signal.SIGTERM)
        try:
            process.wait(5)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


@contextlib.contextmanager
def screen() -> Iterator[str]:
    """Start a virtual screen and return its name."""
    read, write = os.pipe()
    options = ["-displayfd", str(write), "-screen", "0", SIZE + "x24", "-nolisten", "tcp"]
    with running(["Xvfb", *options], pass_fds=[write], stderr=subprocess.DEVNULL):
        os.close(write)
        with os.fdopen(read) as answer:
            yield f":{answer.readline().strip()}"


def environment(home: Path, port: int) -> dict[str, str]:
    """Return the variables for Monado and Blender."""
    settings = {"active": "remote", "remote": {"version": 0, "port": port, "view_count": 2}}
    (home / "monado").mkdir()
    (home / "monado" / "config_v0.json").write_text(json.dumps(settings))
    kept = {key: value for key, value in os.environ.items() if key != "WAYLAND_DISPLAY"}
    return kept | {
        "XDG_CONFIG_HOME": str(home),
        "XDG_RUNTIME_DIR": str(home),
        "XR_RUNTIME_JSON": str(MANIFEST),
        "XRT_COMPOSITOR_NULL": "1",
        "XRT_NO_STDIN": "1",
        "VK_ICD_FILENAMES": str(DRIVER),
        "LIBGL_ALWAYS_SOFTWARE": "1",
        "VR_PORT": str(port),
    }


def wait_for(path: Path, process: subprocess.Popen[bytes], seconds: float = 30.0) -> bool:
    """Wait until a file appears; False if the process ends or takes too long."""
    end = time.monotonic() + seconds
    while not path.exists():
        if process.poll() is not None or time.monotonic() > end:
            return False
        time.sleep(0.05)
    return True


def main(blender: str, script: str, *words: str) -> int:
    """Run the script and return Blender's exit status."""
    for program in ("Xvfb", "monado-service"):
        if shutil.which(program) is None:
            unavailable(f"{program} is not installed")
    for file in (MANIFEST, DRIVER):
        if not file.exists():
            unavailable(f"there is no {file}")
    leave_network()
    with tempfile.TemporaryDirectory() as folder, screen() as display:
        home, port = Path(folder), free_port()
        variables = environment(home, port) | {"DISPLAY": display}
        log = (home / "monado.log").open("wb")
        with running(["monado-service"], env=variables, stdout=log, stderr=log) as service:
            if not wait_for(home / "monado_comp_ipc", service):
                print((home / "monado.log").read_text(errors="replace")[-2000:])
                unavailable("Monado does not start")
            variables["VR_SERVICE"] = str(service.pid)
            command = [blender, "--factory-startup", "--enable-event-simulate", "--gpu-backend"]
            command += ["opengl", "--window-geometry", "0", "0", *SIZE.split("x")]
            command += ["--python-exit-code", "1", "--python", script, "--", *words]
            try:
                return subprocess.run(command, env=variables, timeout=SECONDS).returncode
            except subprocess.TimeoutExpired:
                print("Blender did not end")
                return 1


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
