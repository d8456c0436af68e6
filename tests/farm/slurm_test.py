#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""`velatura farm --engine slurm` on a real Slurm: a cluster of four nodes on this machine, in a folder of its own.

Usage: slurm_test.py BIN [--keep FOLDER]

BIN is the folder of the programs. Two nodes are killed, a piece is preempted twice, a part is damaged on disk; the image is that of one render.
In a second job a piece always fails: the job ends without its frame and names it. SKIPPED where Slurm is not installed.
"""
import argparse
import json
import os
import pathlib
import random
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
NODES = 4
PROGRAMS = ("slurmctld", "slurmd", "sbatch", "scontrol", "scancel", "sinfo", "squeue")
SCENE = [str(ROOT / "scenes/cornell/cornell.usda"), "--bounces", "2"]
PIECES, SPP_OF_PIECE = 16, 64
LARGE = [*SCENE, "--res", "128", "96", "--spp", str(PIECES * SPP_OF_PIECE)]  # a piece takes seconds: something is left to kill
PREEMPTED = 5
# Renders; but the samples SPP_OF_PIECE * PREEMPTED stand still after a second, for as long as there is the file HOLD, until a signal comes
HOLDING = """#!/bin/sh
case "$*" in *--samples=FIRST:*) ;; *) exec VELATURA "$@";; esac
[ -e HOLD ] || exec VELATURA "$@"
VELATURA "$@" &
render=$!
trap 'kill -CONT $render; kill -TERM $render' TERM
sleep 1
kill -STOP $render && touch HOLD.on
while kill -0 $render 2>/dev/null; do wait $render; code=$?; done
rm -f HOLD.on
exit $code
"""
SPP = 128
SMALL = [*SCENE, "--res", "64", "48", "--spp", str(SPP)]
TIMEOUT_S = 300


def settings(folder, port, user):
    lines = {
        "ClusterName": "velatura", "SlurmctldHost": f"{socket.gethostname().split('.')[0]}(127.0.0.1)", "SlurmctldPort": port,
        "SlurmUser": user, "SlurmdUser": user, "AuthType": "auth/none", "CredType": "cred/none", "AuthInfo": "cred_expire=5",
        "StateSaveLocation": f"{folder}/state", "SlurmdSpoolDir": f"{folder}/spool/%n", "SlurmctldPidFile": f"{folder}/run/slurmctld.pid",
        "SlurmdPidFile": f"{folder}/run/slurmd-%n.pid", "SlurmctldLogFile": f"{folder}/log/slurmctld.log",
        "SlurmdLogFile": f"{folder}/log/slurmd-%n.log", "ProctrackType": "proctrack/linuxproc", "TaskPlugin": "task/none",
        "SelectType": "select/cons_tres", "SelectTypeParameters": "CR_Core", "SchedulerType": "sched/backfill",
        "SchedulerParameters": "batch_sched_delay=0,bf_interval=1,sched_interval=1,sched_min_interval=0",
        "JobAcctGatherType": "jobacct_gather/none", "AccountingStorageType": "accounting_storage/none", "MpiDefault": "none",
        "SwitchType": "switch/none", "ReturnToService": 2, "SlurmdTimeout": 10, "SlurmctldTimeout": 10, "KillWait": 5, "MinJobAge": 3600,
        "JobRequeue": 1, "SlurmdParameters": "config_overrides", "PropagateResourceLimits": "NONE"}
    nodes = (f"NodeName=n[1-{NODES}] NodeHostname={socket.gethostname().split('.')[0]} NodeAddr=127.0.0.1 "
             f"Port=[{port + 1}-{port + NODES}] CPUs=1 RealMemory=1000 State=UNKNOWN")
    return "".join(f"{k}={v}\n" for k, v in lines.items()) + nodes + "\nPartitionName=farm Nodes=ALL Default=YES MaxTime=INFINITE State=UP\n"


def alive(pid):
    try:
        os.kill(pid, 0)
        return True
    except OSError:
        return False


class Cluster:
    def __init__(self, folder):
        self.folder, self.pids = folder, {}

    def __enter__(self):
        for name in ("state", "spool", "run", "log"):
            (self.folder / name).mkdir(parents=True)
        user = subprocess.run(["id", "-un"], capture_output=True, text=True, check=True).stdout.strip()
        conf = self.folder / "slurm.conf"
        os.environ["SLURM_CONF"] = str(conf)
        for _ in range(5):  # until the ports are free
            conf.write_text(settings(self.folder, random.randint(20000, 40000), user))
            if subprocess.run(["slurmctld", "-c", "-f", conf]).returncode == 0:
                break
        for i in range(1, NODES + 1):
            subprocess.run(["slurmd", "-c", "-f", conf, "-N", f"n{i}"], check=True)
        for _ in range(100):
            idle = subprocess.run(["sinfo", "-h", "-N", "-t", "idle", "-o", "%N"], capture_output=True, text=True).stdout.split()
            if len(idle) == NODES:
                return self
            time.sleep(0.1)
        self.stop()
        print("SKIPPED: Slurm does not start here:", (self.folder / "log/slurmctld.log").read_text()[-400:].replace("\n", " | "))
        sys.exit(0)

    def __exit__(self, *_):
        self.stop()

    def pid(self, name):
        try:
            return int((self.folder / f"run/{name}.pid").read_text())
        except (OSError, ValueError):
            return 0

    def processes_of(self, node):
        """Those that Slurm started on a node, by their environment."""
        mark = f"SLURMD_NODENAME={node}".encode()
        found = []
        for entry in pathlib.Path("/proc").iterdir():
            if entry.name.isdigit():
                try:
                    words = (entry / "environ").read_bytes().split(b"\0")
                    if mark in words and f"SLURM_CONF={os.environ['SLURM_CONF']}".encode() in words:
                        found.append(int(entry.name))
                except OSError:
                    pass
        return found

    def kill_node(self, node):
        """As a machine that loses its power: nothing of it reports anything."""
        daemon = self.pid(f"slurmd-{node}")
        # What watches a task is its parent, and has no such environment
        pids = self.processes_of(node)
        steps = {int((pathlib.Path("/proc") / str(p) / "stat").read_text().rsplit(")", 1)[1].split()[1]) for p in pids
                 if (pathlib.Path("/proc") / str(p)).exists()}
        steps = {p for p in steps if b"slurmstepd" in pathlib.Path(f"/proc/{p}/cmdline").read_bytes()}
        for pid in (daemon, *steps, *pids):
            try:
                os.kill(pid, signal.SIGKILL)
            except OSError:
                pass

    def stop(self):
        pids = [self.pid(p.stem) for p in (self.folder / "run").glob("*.pid")]
        subprocess.run(["scancel", "--user", str(os.getuid())], stderr=subprocess.DEVNULL)
        for node in range(1, NODES + 1):
            for pid in self.processes_of(f"n{node}"):
                try:
                    os.kill(pid, signal.SIGKILL)
                except OSError:
                    pass
        for pid in filter(None, pids):
            try:
                os.kill(pid, signal.SIGTERM)
            except OSError:
                pass
        for _ in range(100):
            if not any(alive(pid) for pid in pids if pid):
                return
            time.sleep(0.1)


class Job:
    def __init__(self, programs, folder, name, render, options):
        self.programs, self.folder, self.output = programs, folder / f"{name}.farm", folder / f"{name}.exr"
        self.front = folder / f"{name}.sh"  # what --program can name instead of velatura
        self.front.write_text("#!/bin/sh\nexec " + str(programs / "velatura") + ' "$@"\n')
        self.front.chmod(0o755)
        self.submit = [str(programs / "velatura"), "farm", "submit", *render, "-o", str(self.output), "--job", str(self.folder), "--engine",
                       "slurm", "--checkpoint", "1s", *options]

    def start(self):
        done = subprocess.run(self.submit, capture_output=True, text=True)
        if done.returncode:
            sys.exit(f"farm submit: {done.returncode}\n{done.stdout}{done.stderr}")
        print(done.stdout, end="", flush=True)

    def status(self):
        done = subprocess.run([str(self.programs / "velatura"), "farm", "status", str(self.folder), "--json"], capture_output=True, text=True)
        return json.loads(done.stdout)

    def task(self, piece):
        """The number of Slurm, from the state file."""
        return json.loads((self.folder / f"pieces/{piece:04}.json").read_text())["attempts"][-1]["task"]

    def until(self, what, condition):
        end = time.monotonic() + TIMEOUT_S
        while time.monotonic() < end:
            status = self.status()
            if condition(status):
                return status
            if status["state"] in ("complete", "incomplete"):
                sys.exit(f"the job is {status['state']} before {what}")
            time.sleep(0.2)
        sys.exit(f"waited in vain for {what}:\n{json.dumps(self.status(), indent=1)}")

    def running(self, status):
        return [row for row in status["list"] if row["state"] == "running"]


def pixels(programs, file):
    done = subprocess.run([str(programs / "velatura-comp"), "info", "--hash", str(file)], capture_output=True, text=True, check=True)
    return done.stdout.split()[0]


def expect(condition, text):
    if not condition:
        sys.exit(f"expected: {text}")


def everything_goes_wrong(cluster, programs, folder):
    job = Job(programs, folder, "hard", LARGE, ["--pieces", str(PIECES), "--retries", "3", "--sbatch=--comment=a test"])
    hold = folder / "hold"
    hold.touch()
    for name, value in (("VELATURA", programs / "velatura"), ("FIRST", SPP_OF_PIECE * PREEMPTED), ("HOLD", hold)):
        job.front.write_text((HOLDING if name == "VELATURA" else job.front.read_text()).replace(name, str(value)))
    job.submit += ["--program", str(job.front)]
    job.start()
    status = job.until("a done piece", lambda s: s["pieces"]["done"] >= 1 and len(job.running(s)) >= 3)
    # Damage the part that is done
    damaged = next(row["piece"] for row in status["list"] if row["state"] == "done")
    with open(job.folder / f"parts/{damaged:04}.exr", "r+b") as part:
        part.seek(os.path.getsize(part.name) // 2)
        byte = part.read(1)
        part.seek(-1, os.SEEK_CUR)
        part.write(bytes([byte[0] ^ 1]))
    # Preempt a piece twice
    for attempt in (1, 2):
        job.until(f"start {attempt} of piece {PREEMPTED}", lambda s: s["list"][PREEMPTED]["attempts"] == attempt
                  and pathlib.Path(f"{hold}.on").exists())
        # Kill a node meanwhile, which runs another piece
        status = job.until("a running piece on a node to kill", lambda s: any(r["piece"] != PREEMPTED for r in job.running(s)))
        if attempt == 2:
            hold.unlink()
        # Slurm stops all of the task and starts it again; or it warns it, and the piece does so
        subprocess.run(["scontrol", "requeue", job.task(PREEMPTED)] if attempt == 1 else
                       ["scancel", "--batch", "--signal=USR1", job.task(PREEMPTED)], check=True)
        row = next(r for r in job.running(status) if r["piece"] != PREEMPTED)
        print(f"kill {row['node']}, which renders piece {row['piece']}", flush=True)
        cluster.kill_node(row["node"])
    return job, damaged


def check(job, damaged, one):
    done = subprocess.run([str(job.programs / "velatura"), "farm", "wait", str(job.folder)], capture_output=True, text=True, timeout=TIMEOUT_S)
    status = job.status()
    expect(done.returncode == 0, f"a complete job, found {done.returncode}\n{done.stdout}{done.stderr}{json.dumps(status, indent=1)}")
    expect(pixels(job.programs, job.output) == pixels(job.programs, one), "the image of one render")
    rows = status["list"]
    expect(rows[damaged]["attempts"] >= 2, "the damaged part rendered again")
    expect(rows[PREEMPTED]["attempts"] >= 3, "the preempted piece started three times")
    reasons = [a.get("reason", "") for row in rows for a in json.loads((job.folder / f"pieces/{row['piece']:04}.json").read_text())["attempts"]]
    expect(any("damaged" in r for r in reasons), f"the damaged part named: {reasons}")
    expect(sum("is lost" in r for r in reasons) >= 1, f"a lost piece named: {reasons}")
    expect(sum(row["attempts"] == 1 for row in rows) >= PIECES - 6, "the other pieces rendered once")
    print(f"complete after {status['wall_s']:.0f} s; reasons: {sorted(set(filter(None, reasons)))}")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("programs", type=pathlib.Path)
    parser.add_argument("--keep", type=pathlib.Path, help="work in this folder, and leave what is written")
    arguments = parser.parse_args()
    missing = [program for program in PROGRAMS if not shutil.which(program)]
    if missing:
        print(f"SKIPPED: {', '.join(missing)} not found; apt-get install slurmctld slurmd slurm-client")
        return
    programs = arguments.programs.resolve()
    with tempfile.TemporaryDirectory() as temporary:
        folder = (arguments.keep or pathlib.Path(temporary)).resolve()
        folder.mkdir(parents=True, exist_ok=True)
        with Cluster(folder / "slurm") as cluster:
            fails = Job(programs, folder, "fails", SMALL, ["--pieces", "4", "--retries", "1"])
            fails.front.write_text(f"#!/bin/sh\ncase \"$*\" in *--samples={SPP // 4}:{SPP // 2}*) echo 'error: no license [test]' >&2; exit 1;; esac\nexec "
                                   + str(programs / "velatura") + ' "$@"\n')
            fails.submit += ["--program", str(fails.front)]
            job, damaged = everything_goes_wrong(cluster, programs, folder)
            fails.start()
            # Split by what the first samples took, in rounds that the merge submits
            # A front says that each sample took a second: the other 96 are six pieces of 16
            measured = Job(programs, folder, "measured", SMALL, ["--piece-time", "16s"])
            measured.front.write_text(f"#!/bin/sh\n{programs}/velatura \"$@\" || exit $?\nfor word; do case $word in --stats=*) echo "
                                      "'{\"phases_s\": {\"render\": 32}}' > \"${word#--stats=}\";; esac; done\n")
            measured.submit += ["--program", str(measured.front)]
            measured.start()
            one, small = folder / "one.exr", folder / "small.exr"
            for image, render in ((one, LARGE), (small, SMALL)):
                subprocess.run([str(programs / "velatura"), "render", *render, "-o", str(image), "--progress", "none", "-q"], check=True)
            check(job, damaged, one)
            subprocess.run([str(programs / "velatura"), "farm", "wait", str(measured.folder)], check=True, timeout=TIMEOUT_S)
            expect(pixels(programs, measured.output) == pixels(programs, small), "the image of one render of a job that is split by cost")
            rows = [row["samples"] for row in measured.status()["list"]]
            expect(rows == [[0, 32]] + [[first, first + 16] for first in range(32, SPP, 16)], f"a round by what the first samples took: {rows}")
            expect((measured.folder / "preview/0000.png").exists(), "a picture")
            done = subprocess.run([str(programs / "velatura"), "farm", "wait", str(fails.folder)], capture_output=True, text=True,
                                  timeout=TIMEOUT_S)
            expect(done.returncode == 1, f"exit code 1 of a job that lacks a piece, found {done.returncode}: {done.stdout}{done.stderr}")
            for words in ("missing: pieces 1", "no license [test]", "velatura farm retry"):
                expect(words in done.stderr, f"\"{words}\" in {done.stderr}")
            row = fails.status()["list"][1]
            expect(row["attempts"] == 2 and row["state"] == "gave-up", f"two tries: {row}")
            # Mended, it continues where it failed
            fails.front.write_text("#!/bin/sh\nexec " + str(programs / "velatura") + ' "$@"\n')
            subprocess.run([str(programs / "velatura"), "farm", "retry", str(fails.folder)], check=True)
            subprocess.run([str(programs / "velatura"), "farm", "wait", str(fails.folder)], check=True, timeout=TIMEOUT_S)
            expect(pixels(programs, fails.output) == pixels(programs, small), "the image of one render after the retry")
            expect([r["attempts"] for r in fails.status()["list"]] == [1, 3, 1, 1], "only the failed piece rendered again")


if __name__ == "__main__":
    main()
