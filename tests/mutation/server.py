"""Runs the tests of a bench on every mutant, inside of one simulator process.

cocotb loads it behind the bench, whose tests have then passed on the unmutated netlist and have compiled what they
need. Each trial (mutant, test) is a fork of this process: it sets the selector, runs the test and tells how that ended.
A trial that takes twice the cycles of the unmutated run and 1000 more hangs.
"""

from __future__ import annotations

import importlib
import json
import os
import resource
import signal
from dataclasses import dataclass
from pathlib import Path

import cocotb
from cocotb.handle import HierarchyObject
from cocotb.regression import Test, TestGenerator
from cocotb.triggers import SimTimeoutError, Timer, with_timeout
from cocotb.utils import get_sim_time

from tb.lib.stream import PERIOD
from tests.mutation.netlist import SELECT

ALIVE, KILLED, HUNG = "alive", "killed", "hung"
NO_LIMIT = 1 << 40  # simulation steps
PATIENCE = 600  # processor seconds, of an unmutated run
EXIT = {10: ALIVE, 11: KILLED, 12: HUNG}  # anything else is a crash of the simulation


@dataclass
class Trial:
    """One bench test, and what is known of it."""

    test: Test
    steps: int = 0  # of the unmutated run
    seconds: float = 0.0  # processor time of the unmutated run
    runs: int = 0
    kills: int = 0

    def value(self) -> float:
        """Kills to expect for a second."""
        return (self.kills + 1) / (self.runs + 2) / (self.seconds + 0.02)


class Child(Exception):
    """Leaves the scheduler in the forked process."""


def tests(bench: str) -> list[Test]:
    """The tests of a bench module that are not skipped."""
    found: list[Test] = []
    for item in vars(importlib.import_module(bench)).values():
        if isinstance(item, Test):
            found.append(item)
        elif isinstance(item, TestGenerator):
            found += item.generate_tests()
    return [test for test in found if not test.skip]


def selector(handle):
    """The register of the netlist, which may lie below a wrapper."""
    if hasattr(handle, SELECT):
        return getattr(handle, SELECT)
    below = (selector(child) for child in handle if isinstance(child, HierarchyObject))
    return next((found for found in below if found is not None), None)


class Server:
    """Forks the trials, one at a time."""

    def __init__(self, bench: str) -> None:
        self.trials = [Trial(test) for test in tests(bench)]
        self.job: tuple[int, Trial] | None = None  # of the forked process
        self.writer = -1

    def fork(self, mutant: int, trial: Trial) -> tuple[str, int, float]:
        """One trial: its end, simulation steps and processor seconds."""
        reader, writer = os.pipe()
        if os.fork() == 0:
            os.close(reader)
            self.job, self.writer = (mutant, trial), writer
            raise Child
        os.close(writer)
        _, status, usage = os.wait3(0)
        with os.fdopen(reader) as pipe:
            steps = int(pipe.read() or 0)
        if os.WIFSIGNALED(status):  # out of processor time; or an abort: a loop that does not settle
            end = HUNG if os.WTERMSIG(status) in (signal.SIGXCPU, signal.SIGKILL) else KILLED
        else:
            end = EXIT.get(os.WEXITSTATUS(status), KILLED)
        return end, steps, usage.ru_utime + usage.ru_stime

    def run(self, mutants: int) -> list[tuple[str, str]]:
        """(end, test) of every mutant. The tests that have killed most for their time come first."""
        for trial in self.trials:
            end, trial.steps, trial.seconds = self.fork(0, trial)
            assert end == ALIVE, f"{trial.test.name} {end} without a mutation"
        return [self.one(mutant + 1) for mutant in range(mutants)]

    def one(self, mutant: int) -> tuple[str, str]:
        """Runs tests until one kills the mutant."""
        for trial in sorted(self.trials, key=Trial.value, reverse=True):
            end, _, _ = self.fork(mutant, trial)
            trial.runs += 1
            if end != ALIVE:
                trial.kills += 1
                return end, trial.test.name
        return ALIVE, ""


@cocotb.test()
async def serve(dut):
    server = Server(os.environ["MUTATION_BENCH"])
    try:
        ends = server.run(int(os.environ["MUTATION_COUNT"]))
    except Child:
        await attempt(dut, server)
    kills = {t.test.name: t.kills for t in server.trials}
    Path(os.environ["MUTATION_REPORT"]).write_text(json.dumps({"kills": kills, "mutants": ends}))


async def attempt(dut, server: Server) -> None:
    """In the fork: one test on one mutant; never returns."""
    mutant, trial = server.job
    null = os.open(os.devnull, os.O_WRONLY)
    for stream in (1, 2):
        os.dup2(null, stream)
    seconds = int(4 * trial.seconds + 3) if trial.steps else PATIENCE
    resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds + 1))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    try:
        selector(dut).value = mutant
        await Timer(1, unit="step")
        start = get_sim_time("step")
        limit = 2 * trial.steps + 1000 * PERIOD if trial.steps else NO_LIMIT
        test = trial.test
        await with_timeout(test.func(dut, *test.args, **test.kwargs), limit, "step")
        os.write(server.writer, str(get_sim_time("step") - start).encode())
    except SimTimeoutError:
        os._exit(12)
    except BaseException:
        os._exit(11)
    os._exit(10)
