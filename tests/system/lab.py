"""A laboratory of several hosts on one machine: each has a network namespace and an sshd of its own.

All is made within the network namespace of the test run (see scripts/with-loopback), so nothing of it is left behind
when the processes are gone. The hosts share files and process ids; each has a state folder of its own.
"""

import contextlib
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import psutil

from vrg.testing.waiting import wait_until

BRIDGE = "vrg-lab"
HERE = "10.77.0.1"
"""The address of the launcher's host, which is the test's own namespace."""
VRG = f"{Path(sys.executable).parent}/vrg"
_START = 120.0
"""s of real time for a command of a moment."""


def run(*command: str) -> None:
    """Run a command that succeeds."""
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=_START)
    assert done.returncode == 0, f"{' '.join(command)}: {done.stdout}{done.stderr}"


@dataclass
class LabHost:
    """One host.

    Args:
        name: its name for ssh. address: its address. state: its state folder.
    """

    name: str
    address: str
    state: Path
    holder: subprocess.Popen[bytes]
    sshd: subprocess.Popen[bytes] | None = None
    link: str = ""

    def inside(self, *command: str) -> tuple[str, ...]:
        """A command that runs in the host's network."""
        return ("nsenter", "-t", str(self.holder.pid), "-n", *command)

    def processes(self) -> list[psutil.Process]:
        """Every process that runs on this host by order of a launcher."""
        found = []
        for process in psutil.process_iter():
            with contextlib.suppress(psutil.NoSuchProcess, psutil.AccessDenied, OSError):
                if process.status() != psutil.STATUS_ZOMBIE and self._hosts(process):
                    found.append(process)
        return found

    def _hosts(self, process: psutil.Process) -> bool:
        """Whether a process has inherited this host's state folder, or writes to a log in it: nobody else does."""
        # A process that has a title of its own has lost its environment to it.
        outputs = [os.readlink(f"/proc/{process.pid}/fd/{number}") for number in (1, 2)]
        inherited = process.environ().get("XDG_STATE_HOME") == str(self.state)
        return inherited or any(output.startswith(str(self.state)) for output in outputs)

    def agent(self) -> psutil.Process:
        """The agent that runs there."""
        for process in self.processes():
            with contextlib.suppress(psutil.NoSuchProcess):
                if process.cmdline()[-1:] == ["host"]:
                    return process
        raise AssertionError(f"no agent runs on {self.name}: {self.processes()}")

    def cut(self) -> None:
        """Cut its link."""
        run("ip", "link", "set", self.link, "down")

    def mend(self) -> None:
        """Mend its link."""
        run("ip", "link", "set", self.link, "up")


@dataclass
class Lab:
    """Several hosts, and how ssh reaches them.

    Args:
        hosts: by name. environment: what a launcher needs to reach them.
    """

    hosts: dict[str, LabHost] = field(default_factory=dict)
    environment: dict[str, str] = field(default_factory=dict)

    def tables(self) -> str:
        """The tables [machines.NAME] of a match file."""
        return "".join(f'[machines.{name}]\nhost = "{name}"\nvrg = "{VRG}"\n' for name in self.hosts)


@contextlib.contextmanager
def laboratory(folder: Path, *names: str) -> Iterator[Lab]:
    """Make the hosts of these names, until the context ends."""
    folder.mkdir(parents=True, exist_ok=True)
    key = folder / "key"
    run("ssh-keygen", "-q", "-t", "ed25519", "-N", "", "-f", str(key))
    known, config = folder / "known_hosts", folder / "ssh_config"
    lab = Lab(environment={"VRG_SSH": f"ssh -F {config}"})
    with contextlib.ExitStack() as stack:
        run("ip", "link", "add", BRIDGE, "type", "bridge")
        stack.callback(run, "ip", "link", "del", BRIDGE)
        run("ip", "address", "add", f"{HERE}/24", "dev", BRIDGE)
        run("ip", "link", "set", BRIDGE, "up")
        Path("/run/sshd").mkdir(exist_ok=True)
        lines = []
        for number, name in enumerate(names, 2):
            host = _host(stack, folder / name, name, f"10.77.0.{number}", number)
            _serve_ssh(stack, host, folder / name, key)
            lab.hosts[name] = host
            with known.open("a") as file:
                file.write(f"{host.address} {(folder / name / 'host_key.pub').read_text()}")
            lines.append(f"Host {name}\n  HostName {host.address}\n")
        lines.append(f"Host *\n  User root\n  IdentityFile {key}\n  UserKnownHostsFile {known}\n")
        lines.append("  StrictHostKeyChecking yes\n  IdentitiesOnly yes\n")
        config.write_text("".join(lines))
        for host in lab.hosts.values():
            _wait_for_ssh(host, config)
        yield lab


def _host(stack: contextlib.ExitStack, folder: Path, name: str, address: str, number: int) -> LabHost:
    state = folder / "state"
    state.mkdir(parents=True)
    holder = subprocess.Popen(["unshare", "--net", "sleep", "infinity"])
    stack.callback(_end, holder)
    own = os.readlink("/proc/self/ns/net")
    wait_until(lambda: os.readlink(f"/proc/{holder.pid}/ns/net") != own, "a network namespace")
    host = LabHost(name, address, state, holder, link=f"vrg{number}")
    run("ip", "link", "add", host.link, "type", "veth", "peer", "name", "eth0", "netns", str(holder.pid))
    stack.callback(run, "ip", "link", "del", host.link)  # a namespace gives its links back only some time after its end
    run("ip", "link", "set", host.link, "master", BRIDGE)
    run("ip", "link", "set", host.link, "up")
    run(*host.inside("ip", "address", "add", f"{address}/24", "dev", "eth0"))
    run(*host.inside("ip", "link", "set", "eth0", "up"))
    run(*host.inside("ip", "link", "set", "lo", "up"))
    return host


def _serve_ssh(stack: contextlib.ExitStack, host: LabHost, folder: Path, key: Path) -> None:
    run("ssh-keygen", "-q", "-t", "ed25519", "-N", "", "-f", str(folder / "host_key"))
    config = folder / "sshd_config"
    config.write_text(
        f"ListenAddress {host.address}\nHostKey {folder / 'host_key'}\nAuthorizedKeysFile {key}.pub\n"
        "StrictModes no\nUsePAM no\nPermitRootLogin yes\nPidFile none\nPrintMotd no\n"
        f"SetEnv XDG_STATE_HOME={host.state} PYTHONPATH={Path(__file__).parents[2]}\n"
    )
    sshd = shutil.which("sshd") or "/usr/sbin/sshd"
    with (folder / "sshd.log").open("wb") as log:
        host.sshd = subprocess.Popen(host.inside(sshd, "-D", "-e", "-f", str(config)), stdout=log, stderr=log)
    stack.callback(_end, host.sshd)


def _wait_for_ssh(host: LabHost, config: Path) -> None:
    command = ["ssh", "-F", str(config), "-o", "BatchMode=yes", host.name, "true"]

    def answers() -> bool:
        return subprocess.run(command, capture_output=True, check=False, timeout=_START).returncode == 0

    wait_until(answers, f"the sshd of {host.name}, which may say more in its log")


def _end(process: subprocess.Popen[bytes]) -> None:
    process.kill()
    process.wait()
