# SPDX-License-Identifier: Apache-2.0
"""What the checks of the pages share: NAME.py [ROOT] prints what is wrong and exits with 1 if anything is; NAME.py --self-test."""
import pathlib
import sys


def run(check, self_test):
    """check(root) returns what is wrong, a line each, and what to print if nothing is. self_test() exits with a message if it fails."""
    if sys.argv[1:] == ["--self-test"]:
        self_test()
        return
    wrong, done = check(pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else pathlib.Path(__file__).parents[2]).resolve())
    print("\n".join(wrong) if wrong else done)
    sys.exit(1 if wrong else 0)
