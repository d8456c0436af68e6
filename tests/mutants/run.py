#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Plants the bugs of mutants.toml one by one and tells which test notices. Usage: ./dev mutants [NAME…]
[--size commit|all] [--jobs N] [--resume] [--write]

Bugs are planted in copies of the tree under build/mutants, what is not committed yet included (new files: once git knows
them). Of each the test that the table names runs first, then the hard cases of every commit; with --size all, which is the
default, also all tests of the program that the table names and of the bug's tier. --size commit takes the bugs whose test
is labelled quick, and runs quick tests only: what `./dev test` must notice. No test is asked that has not passed without a bug before. Fails when a bug
is not noticed or does not compile, or a test fails without any. --resume takes what earlier runs found of the same bug in
the same file; --write makes docs/engineering/mutation_testing.md of all. --check only holds the table against the tree.
"""
import argparse
import concurrent.futures
import contextlib
import datetime
import fnmatch
import hashlib
import json
import os
import pathlib
import queue
import re
import subprocess
import sys
import threading
import time
import tomllib

ROOT = pathlib.Path(__file__).resolve().parents[2]
COPIES = ROOT / "build/mutants"
PAGE = ROOT / "docs/engineering/mutation_testing.md"
# A bug that makes a loop endless is noticed, too
LONGEST_S = 300.0

sys.path.insert(0, str(ROOT / "tests/hardcases"))
from run import CASES, case_of, filter_of  # noqa: E402


def mutants():
    return tomllib.loads((ROOT / "tests/mutants/mutants.toml").read_text())["mutant"]


def not_on_commit():
    return tomllib.loads((ROOT / "tests/hardcases/cases.toml").read_text())["not_on_commit"]


def test_of(mutant):
    """Suite (a folder of tests) and filter of the test that should notice."""
    return mutant["catcher"].split(":", 1)


def full_patterns():
    """Tests that only `./dev test --full` runs: the arguments FULL of add_tier_test, of all folders."""
    lists = [p.read_text() for p in (ROOT / "tests").rglob("CMakeLists.txt")]
    return [pattern.strip('"') for text in lists for words in re.findall(r"^\s+FULL ([^)]*)", text, re.MULTILINE) for pattern in words.split()]


def is_quick(mutant):
    suite, test = test_of(mutant)[1].split(".", 1)
    # A test with parameters is quick if any of its values is
    return not any(fnmatch.fnmatchcase(f"{suite}.{test}", pattern) or fnmatch.fnmatchcase(f"X/{suite}.{test}/0", pattern)
                   for pattern in full_patterns())


def check(table):
    """What is wrong with the table, as the tree is now."""
    tests = "\n".join(p.read_text() for p in (ROOT / "tests").rglob("*.cpp"))
    known = {f"{suite}.{name}" for suite, name in re.findall(r"^TEST(?:_F|_P)?\((\w+),\s*(\w+)\)", tests, re.MULTILINE)}
    # Those of tests/hardcases/selftest_test.cpp have no line of their own
    known |= {f"{case}Selftest.AnswerIsKnown" for case in re.findall(r'{"(H\d\d)"', (ROOT / "src/selftest/checks.cpp").read_text())}
    wrong = []
    names = [m["name"] for m in table]
    wrong += [f"{name}: stands twice" for name in sorted(set(names)) if names.count(name) > 1]
    for m in table:
        path = ROOT / m["file"]
        count = path.read_text().count(m["find"]) if path.exists() else 0
        if count != 1:
            wrong.append(f"{m['name']}: its text occurs {count} times in {m['file']}, expected once")
        if m["find"] == m["put"]:
            wrong.append(f"{m['name']}: changes nothing")
        if test_of(m)[1] not in known:
            wrong.append(f"{m['name']}: no test {test_of(m)[1]}")
    return wrong


class BuildFailed(Exception):
    pass


class FailsWithoutBug(Exception):
    pass


class Copy:
    """A copy of the tree with a build of its own."""

    def __init__(self, number, commit, jobs):
        self.folder, self.jobs = COPIES / str(number), jobs
        self.passed = set()  # runs that passed without a bug
        self.build_folder = self.folder / "build/release"
        if self.folder.exists():
            git("checkout", "-q", "-f", "--detach", commit, folder=self.folder)
        else:
            git("worktree", "prune")
            git("worktree", "add", "-q", "-f", "--detach", str(self.folder), commit)
        if not (self.build_folder / "build.ninja").exists():
            run(["cmake", "--preset", "release"], self.folder)

    def build(self, *targets):
        run(["cmake", "--build", "build/release", "--parallel", str(self.jobs), "--target", *targets], self.folder)

    def programs(self):
        return (self.build_folder / "tests/hardcases.txt").read_text().split()

    def failing_test(self, program, test_filter):
        """The first test that fails, or null."""
        environment = dict(os.environ, VELATURA_HARDCASES_SIZE="commit")
        environment.pop("VELATURA_HARDCASES_RECORD", None)
        command = [self.build_folder / "tests" / program, f"--gtest_filter={test_filter}", "--gtest_fail_fast"]
        try:
            done = subprocess.run(command, env=environment, cwd=self.folder, stdin=subprocess.DEVNULL, timeout=LONGEST_S,
                                  stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace")
        except subprocess.TimeoutExpired as end:
            return last_test((end.stdout or b"").decode(errors="replace"), program) + " (does not end)"
        if done.returncode == 0:
            return None
        failed = re.search(r"^\[  FAILED  \] ([^\s,]+)", done.stdout, re.MULTILINE)
        return failed[1] if failed else last_test(done.stdout, program) + " (ends the program)"

    def first_failure(self, runs):
        """Of several programs at a time."""
        with concurrent.futures.ThreadPoolExecutor(self.jobs) as pool:
            found = [pool.submit(self.failing_test, *r) for r in runs]
            for one in concurrent.futures.as_completed(found):
                if one.result():
                    for other in found:
                        other.cancel()
                    return one.result()
        return None

    def pass_without_bug(self, targets, runs):
        """Throws if they do not."""
        left = [r for r in runs if r not in self.passed]
        if not left:
            return
        try:
            self.build(*targets)
        except BuildFailed as failure:
            raise FailsWithoutBug(str(failure)) from failure
        if test := self.first_failure(left):
            raise FailsWithoutBug(test)
        self.passed.update(left)

    def hard_cases(self):
        test_filter = filter_of(CASES, not_on_commit())
        return [(program, test_filter) for program in self.programs()]

    def whole_tests(self, mutant):
        """All tests of the programs of the suite that should notice and of the tier."""
        tier = re.sub(r"^(src|plugins)/|/generated$", "", str(pathlib.PurePath(mutant["file"]).parent)).replace("/", "_")
        programs = self.program_of_suite()
        return [(name, "*") for name in dict.fromkeys(programs[suite] for suite in (test_of(mutant)[0], tier) if suite in programs)]

    def program_of_suite(self):
        lines = (self.build_folder / "tests/suites.txt").read_text().splitlines()
        return {suite: f"velatura_test_{program}" for suite, program in (line.split() for line in lines if line)}


def last_test(output, program):
    begun = re.findall(r"^\[ RUN      \] (\S+)", output, re.MULTILINE)
    return begun[-1] if begun else program


def run(command, folder):
    done = subprocess.run(command, cwd=folder, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                          text=True, errors="replace")
    if done.returncode != 0:
        raise BuildFailed(done.stdout[-4000:])


def git(*arguments, folder=ROOT):
    return subprocess.run(["git", *arguments], cwd=folder, check=True, stdout=subprocess.PIPE, text=True).stdout.strip()


def commit_of_tree():
    """Holds what is not committed yet, too."""
    return git("stash", "create") or git("rev-parse", "HEAD")


@contextlib.contextmanager
def planted(copy, mutant):
    path = copy.folder / mutant["file"]
    sound = path.read_text()
    path.write_text(sound.replace(mutant["find"], mutant["put"]))
    try:
        yield
    finally:
        path.write_text(sound)


def named_step(copy, mutant):
    """What to build, and what to run."""
    suite, test_filter = test_of(mutant)
    program = copy.program_of_suite()[suite]
    # Tests with parameters have a prefix and a suffix
    yield [program], [(program, f"{test_filter}:*/{test_filter}/*")]


def wider_steps(copy, mutant, size):
    yield ["velatura_hardcases"], copy.hard_cases()
    if size == "all":
        runs = copy.whole_tests(mutant)
        yield [name for name, _ in runs], runs


def noticed(copy, mutant, steps):
    """The test that notices, or null."""
    for targets, runs in steps:
        copy.pass_without_bug(targets, runs)
        with planted(copy, mutant):
            copy.build(*targets)
            if test := copy.first_failure(runs):
                return test
    return None


def try_mutant(copy, mutant, steps):
    begin = time.monotonic()
    result = {"name": mutant["name"], "file": mutant["file"], "test": None, "error": None}
    try:
        result["test"] = noticed(copy, mutant, steps)
    except BuildFailed as failure:
        result["error"] = str(failure)
    result["seconds"] = time.monotonic() - begin
    return result


def size_of(test):
    if case_of(test) not in CASES:
        return "tests"
    left_out = [pattern.strip("*") for pattern in not_on_commit()]
    return "nightly" if any(part in test for part in left_out) else "commit"


def key_of(mutant):
    sound = (ROOT / mutant["file"]).read_text()
    return hashlib.sha256(json.dumps([sound, mutant["find"], mutant["put"]]).encode()).hexdigest()


def tell(result):
    if result["error"]:
        return f"{result['name']:34} does not compile:\n{result['error']}"
    who = f"{result['test']} [{size_of(result['test'])}]" if result["test"] else "SURVIVES"
    return f"{result['name']:34} {result['seconds']:6.1f} s  {who}"


def try_all(copies, chosen, steps_of, record):
    """Bugs for one program come one after the other."""
    waiting = queue.SimpleQueue()
    for mutant in sorted(chosen, key=lambda m: test_of(m)[0]):
        waiting.put(mutant)
    lock = threading.Lock()

    def work(copy):
        while True:
            try:
                mutant = waiting.get_nowait()
            except queue.Empty:
                return
            result = try_mutant(copy, mutant, steps_of(copy, mutant))
            with lock:
                record(mutant, result)

    with concurrent.futures.ThreadPoolExecutor(len(copies)) as pool:
        for one in [pool.submit(work, copy) for copy in copies]:
            one.result()


def page(table, results):
    """docs/engineering/mutation_testing.md."""
    count = {size: sum(1 for r in results.values() if size_of(r["test"]) == size) for size in ("commit", "nightly", "tests")}
    out = [f"""# Mutation testing

How well the tests detect bugs: `./dev mutants` plants small bugs, one at a time, in copies of the tree, and reports which test fails.
`tests/mutants/mutants.toml` lists the bugs.

    ./dev mutants                       all bugs, every test that can detect them
    ./dev mutants --size commit         those that the quick tests must detect

For each bug the test that should fail runs first, and the search ends with the first failure: more tests than the named one can
detect a bug. A bug that no test detects is a gap: it gets a test with an oracle, and is never made easier to detect.

{datetime.date.today().isoformat()}: {len(results)} bugs, all of them detected, {count['commit']} by a hard case that runs on every
commit ([hard_cases.md](hard_cases.md)), {count['nightly']} by one that runs at night, {count['tests']} by other tests. Each row is the latest run
with the present file (`./dev mutants --resume --write`). Seconds are those of building and testing, on a busy machine.

| bug | file | what images would show | detected by | size | s |
|---|---|---|---|---|---|"""]
    for m in table:
        r = results[m["name"]]
        out.append(f"| {m['name']} | {m['file']} | {m['shows']} | {r['test']} | {size_of(r['test'])} | {r['seconds']:.0f} |")
    return "\n".join(out) + "\n"


def main():
    parser = argparse.ArgumentParser(prog="./dev mutants", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", metavar="NAME", help="these bugs alone")
    parser.add_argument("--size", choices=["commit", "all"], default="all")
    parser.add_argument("--jobs", type=int, default=max(1, (os.cpu_count() or 1) // 2), help="bugs at a time, each in a copy of its own")
    parser.add_argument("--resume", action="store_true", help="take what earlier runs found of the same bug in the same file")
    parser.add_argument("--write", action="store_true", help="put the table into docs/engineering/mutation_testing.md")
    parser.add_argument("--check", action="store_true", help="only hold the table against the tree")
    arguments = parser.parse_args()

    table = mutants()
    if wrong := check(table):
        sys.exit("\n".join(wrong))
    if arguments.check:
        print(f"{len(table)} bugs, every text occurs once")
        return
    if unknown := set(arguments.names) - {m["name"] for m in table}:
        sys.exit(f"no bugs of these names: {', '.join(sorted(unknown))}")
    if arguments.write and (arguments.names or arguments.size != "all"):
        parser.error("--write needs all bugs")
    chosen = [m for m in table if not arguments.names or m["name"] in arguments.names]
    if arguments.size == "commit":
        chosen = [m for m in chosen if is_quick(m)]

    COPIES.mkdir(parents=True, exist_ok=True)
    commit = commit_of_tree()
    found_file = COPIES / "found.json"
    found = json.loads(found_file.read_text()) if found_file.exists() else {}
    known = {m["name"]: found[key_of(m)] for m in chosen if arguments.resume and key_of(m) in found}
    results = dict(known)

    def record(mutant, result):
        print(tell(result), flush=True)
        results[mutant["name"]] = result
        if result["test"]:
            found[key_of(mutant)] = result
            found_file.write_text(json.dumps(found))

    left = [m for m in chosen if m["name"] not in known]
    begin = time.monotonic()
    if left:
        workers = max(1, min(arguments.jobs, len(left)))
        copies = [Copy(k + 1, commit, max(1, (os.cpu_count() or 1) // workers)) for k in range(workers)]
        try:
            # The wider search needs more programs: only for what the named tests have missed
            try_all(copies, left, lambda copy, m: named_step(copy, m), record)
            missed = [m for m in left if not results[m["name"]]["test"] and not results[m["name"]]["error"]]
            try_all(copies, missed, lambda copy, m: wider_steps(copy, m, arguments.size), record)
        except FailsWithoutBug as failure:
            sys.exit(f"fails without a bug: {failure}")

    print()
    for m in chosen:
        print(tell(results[m["name"]]))
    missed = [r["name"] for r in results.values() if not r["test"]]
    sizes = [size_of(r["test"]) for r in results.values() if r["test"]]
    print(f"{len(results)} bugs in {time.monotonic() - begin:.0f} s, {len(sizes)} noticed: {sizes.count('commit')} by hard cases of every "
          f"commit, {sizes.count('nightly')} by nightly ones, {sizes.count('tests')} by other tests" +
          (f"; not noticed: {', '.join(missed)}" if missed else ""))
    if missed:
        sys.exit(1)
    if arguments.write:
        PAGE.write_text(page(table, results))
        print(f"wrote {PAGE.relative_to(ROOT)}")


if __name__ == "__main__":
    main()
