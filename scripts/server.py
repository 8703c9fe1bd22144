"""Does commands of the program by `signorini serve`, which starts PETSc once and forks for each command."""

import json
import os
import signal
import socket
import subprocess
import tempfile
from contextlib import suppress


class Server:
    """A process of the program that does one command after another. It starts with the first command. Signals of the terminal
    come to it by this process alone."""

    def __init__(self, program, output=False, **options):
        """The `output` of the commands is dropped, or joins their errors. The `options` are those of subprocess.Popen."""
        self.program, self.output, self.process, self.own = str(program), output, None, None
        self.options = {**options, "process_group": 0}

    def start(self):
        """Starts the server, unless it runs."""
        if self.process is None or self.process.poll() is not None:
            self.close()
            self.errors = tempfile.TemporaryFile()
            self.commands, other = socket.socketpair()
            words = [self.program, "serve", *["--output"] * self.output]
            with other:
                self.process = subprocess.Popen(words, stdin=other, stdout=other, stderr=self.errors, **self.options)

    def run(self, arguments, timeout=None):
        """Does a command; returns its exit code, 128 + n after the signal n, and its errors. After `timeout` seconds it is
        ended, with TimeoutError."""
        self.start()
        try:
            code = self.answer(arguments, timeout)
        except BaseException:
            self.kill()
            raise
        self.errors.seek(0)
        text = self.errors.read().decode(errors="replace")
        self.errors.seek(0)
        self.errors.truncate()
        if code and not any(line.startswith("error") for line in text.splitlines()):
            # mpiexec has exit codes of its own above 128.
            reason = f": {signal.strsignal(code - 128)}" if code - 128 in signal.valid_signals() else ""
            text += f"error: the run ended with exit code {code}{reason}\n"
        if code > 128:
            # A signal to all processes ends the server too.
            self.close()
        return code, text

    def answer(self, arguments, timeout):
        """The exit code of a command."""
        self.commands.settimeout(timeout)
        line = b""
        # The server may have ended.
        with suppress(ConnectionError):
            self.commands.sendall(json.dumps(arguments).encode() + b"\n")
            line = self.commands.recv(16)
        if line == b"null\n":
            # The command needs a process of its own.
            output = self.errors if self.output else subprocess.DEVNULL
            self.own = subprocess.Popen([self.program, *arguments], stdout=output, stderr=self.errors, **self.options)
            try:
                code, self.own = self.own.wait(timeout), None
            except subprocess.TimeoutExpired as late:
                raise TimeoutError from late
        elif line:
            return int(line)
        else:
            # Its command ends with it.
            self.send_signal(signal.SIGKILL)
            code = self.process.wait()
        return code if code >= 0 else 128 - code

    def send_signal(self, number):
        """Sends a signal to the command. The server ends after it."""
        if self.own:
            self.own.send_signal(number)
        elif self.process:
            # The command is in the group of the server.
            with suppress(ProcessLookupError):
                os.killpg(self.process.pid, number)

    def close(self):
        """Ends the server after its command."""
        if self.process:
            self.errors.close()
            self.commands.close()
            self.process.wait()
            self.process = None

    def kill(self):
        """Ends the command and the server."""
        self.send_signal(signal.SIGKILL)
        if self.own:
            self.own.wait()
            self.own = None
        self.close()
