# SPDX-License-Identifier: Apache-2.0
"""Runs plans of deploy/steps.sh in a copy of it. A function of the plan adds to SECONDS instead of waiting.

usage: steps_test.py SOURCE
"""

import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

SOURCE = pathlib.Path(sys.argv.pop(1))


def run(plan, seconds=None):
    """Returns the exit code, and the result of each step as the table shows it."""
    with tempfile.TemporaryDirectory() as folder:
        (pathlib.Path(folder) / "deploy").mkdir()
        script = shutil.copy(SOURCE / "deploy" / "steps.sh", pathlib.Path(folder) / "deploy")
        environment = {k: v for k, v in os.environ.items() if k != "TENDON_SECONDS"}
        if seconds is not None:
            environment["TENDON_SECONDS"] = str(seconds)
        text = f"""
            set -euo pipefail
            . {script}
            finish() {{ table; return "$1"; }}
            lasts() {{ SECONDS=$((SECONDS + $1)); }}
            plan test
            {plan}
            run_steps
        """
        done = subprocess.run(["bash", "-c", text], env=environment, capture_output=True, text=True, timeout=60)
        table = done.stdout.rpartition("step                     seconds  result\n")[2]
        return done.returncode, dict(re.findall(r"^(\w+) +(?:\d+|-)  (.*)$", table, re.M)), done.stderr


SLOW_AND_LATER = """
    add --loud 40 slow lasts 300
    add 100 middle true
    add 1 last true
"""


class Steps(unittest.TestCase):
    def test_steps_that_end_in_time_run(self):
        # (60 + 300) / (60 + 40) = 3.6 times slower than planned, so the second step would end at 300 + 100 * 3.6 = 660 s.
        code, results, errors = run(SLOW_AND_LATER, 665)
        self.assertEqual((code, errors), (0, ""))
        self.assertEqual((results["middle"], results["last"]), ("passed", "passed"))

    def test_a_slow_machine_skips_the_late_step_and_all_after_it(self):
        code, results, errors = run(SLOW_AND_LATER, 655)
        self.assertEqual((code, errors), (0, ""))
        for step in ("middle", "last"):
            self.assertEqual(results[step], "skipped: this machine needs more than TENDON_SECONDS=655")

    def test_without_a_limit_nothing_is_skipped(self):
        self.assertEqual(run(SLOW_AND_LATER)[1]["last"], "passed")

    def test_a_failed_step_ends_the_plan(self):
        code, results, _ = run("add 1 good true\nadd 1 bad false\nadd 1 last true")
        self.assertEqual(code, 1)
        self.assertEqual(results, {"good": "passed", "bad": "FAILED", "last": "not run"})

    def test_a_skipped_step_says_why(self):
        code, results, _ = run('add 1 first skip "no such package"\nadd 1 last true')
        self.assertEqual((code, results["first"], results["last"]), (0, "skipped: no such package", "passed"))


if __name__ == "__main__":
    unittest.main()
